"""Kickstand's functions for a notebook, a page or a cluster. They return data, print nothing and draw nothing.

    from kickstand_tools import api

    six = api.fit_six_positions(["1.csv", "2.csv", "3.csv", "4.csv", "5.csv", "6.csv", "7.csv"])
    two = api.fit_two_positions("KICKSTAND.csv", "UPRIGHT.csv", six.calibration)
    lean = api.replay("RIDE.csv.gz", two.calibration)                     # lean.t_s, lean.lean_deg, ...
    after = api.smooth("RIDE.csv.gz", two.calibration)                    # after.lean_deg, after.lean_sigma_deg, ...
    stops = api.find_stops(api.vehicle_channels("RIDE.csv.gz", two.calibration))

A log is a path, an open file of text or bytes, a Log made of arrays, or a Stretch of one of these. Tables have
to_pandas(). What takes long takes `progress`, a function that is called with (done, total).

InputError says in one line what is wrong with what was given. Its subclass RefusedInput has the code and the values of
a refusal of the firmware's (kickstand.errors). sentence() puts a notice or a refusal into words.
"""

from .analysis.channels import Channels
from .analysis.export.export import export
from .analysis.overview import Overview, overview
from .analysis.ride import Ride, open_ride, vehicle_channels
from .analysis.stops.brake_test import Stop, find_stops
from .analysis.summary import Summary, summary
from .calibration.drive import DriveFit, fit_drive
from .calibration.drive_events import DriveEvent
from .calibration.file import CalibrationFile, read_calibration, write_calibration
from .calibration.six import SixPositions, fit_six_positions
from .calibration.two import TwoPositions, fit_two_positions
from .errors import InputError
from .estimation.alignment import RideFit, fit_ride
from .estimation.smooth import SmoothedRide, smooth
from .fleet.brake_tests import brake_tests
from .fleet.manifest import Period, by_pattern, read_manifest
from .fleet.period import PeriodResult, work_on_period
from .fleet.run import FleetRun, run_fleet
from .imports.importing import Imported, import_recording, write_imported
from .joining.agreement import Agreement, compare_rides
from .joining.joined import Joined, join_track, write_joined
from .joining.track import Track
from .joining.track_files import read_track
from .logs.csv_lines import cut_log, write_log
from .logs.log import Log
from .logs.reader import read_log
from .logs.stretch import Stretch
from .overlay.overlay import Overlaid, overlay
from .refusals import RefusedInput, sentence
from .replay.replay import LeanTable, replay
from .simulation.ride import Ride as SimulatedRide
from .simulation.ride import ride as simulate_ride
from .web.site import site_files, write_site

__all__ = [
    "Agreement",
    "CalibrationFile",
    "Channels",
    "DriveEvent",
    "DriveFit",
    "FleetRun",
    "Imported",
    "InputError",
    "Joined",
    "LeanTable",
    "Log",
    "Overlaid",
    "Overview",
    "Period",
    "PeriodResult",
    "RefusedInput",
    "Ride",
    "RideFit",
    "SimulatedRide",
    "SixPositions",
    "SmoothedRide",
    "Stop",
    "Stretch",
    "Summary",
    "Track",
    "TwoPositions",
    "brake_tests",
    "by_pattern",
    "compare_rides",
    "cut_log",
    "export",
    "find_stops",
    "fit_drive",
    "fit_ride",
    "fit_six_positions",
    "fit_two_positions",
    "import_recording",
    "join_track",
    "open_ride",
    "overlay",
    "overview",
    "read_calibration",
    "read_log",
    "read_manifest",
    "read_track",
    "replay",
    "run_fleet",
    "sentence",
    "simulate_ride",
    "site_files",
    "smooth",
    "summary",
    "vehicle_channels",
    "work_on_period",
    "write_calibration",
    "write_imported",
    "write_joined",
    "write_log",
    "write_site",
]
