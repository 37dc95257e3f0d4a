"""Kickstand's functions for a notebook, a page or a cluster. They return data, print nothing and draw nothing.

    from kickstand_tools import api

    six = api.fit_procedure("SIX.csv")                                    # or fit_six_positions(["1.csv", ...])
    two = api.fit_two_positions("KICKSTAND.csv", "UPRIGHT.csv", six.calibration)
    lean = api.replay("RIDE.csv.gz", two.calibration)                     # lean.t_s, lean.lean_deg, ...
    after = api.smooth("RIDE.csv.gz", two.calibration)                    # after.lean_deg, after.lean_sigma_deg, ...
    stops = api.find_stops(api.vehicle_channels("RIDE.csv.gz", two.calibration))

A log is a path, an open file of text or bytes, a Log made of arrays, or a Stretch of any of these. to_pandas() converts
a table. Slow functions accept `progress`, a function that is called with (done, total). The examples use the names of
this module, and numpy as np.

The text of an InputError is one line: what is wrong with the input, and what to do. Its subclass RefusedInput has the
reason as a Message. Notices are Messages too. A Message has a code and named fields, and sentence() returns its text.
"""

from kickstand_sim.simulation import ride as _simulation

from .analysis.export import export as export
from .analysis.overview import Overview as Overview, Summary as Summary, overview as overview, summary as summary
from .analysis.ride import (
    Channels as Channels,
    Ride as Ride,
    open_ride as open_ride,
    vehicle_channels as vehicle_channels,
)
from .analysis.stops import Stop as Stop, brake_tests as brake_tests, find_stops as find_stops
from .calibration.drive import DriveFit as DriveFit, fit_drive as fit_drive
from .calibration.drive_events import DriveEvent as DriveEvent
from .calibration.file import (
    CalibrationFile as CalibrationFile,
    read_calibration as read_calibration,
    write_calibration as write_calibration,
)
from .calibration.poses import (
    SixPositions as SixPositions,
    TwoPositions as TwoPositions,
    fit_procedure as fit_procedure,
    fit_six_positions as fit_six_positions,
    fit_two_positions as fit_two_positions,
)
from .checks.log import CheckedLog as CheckedLog, check_log as check_log
from .common.messages import (
    InputError as InputError,
    Message as Message,
    RefusedInput as RefusedInput,
    sentence as sentence,
)
from .estimation.alignment import RideFit as RideFit, fit_ride as fit_ride
from .estimation.smooth import SmoothedRide as SmoothedRide, smooth as smooth
from .imports.importing import (
    Imported as Imported,
    import_recording as import_recording,
    write_imported as write_imported,
)
from .joining.agreement import Agreement as Agreement, compare_rides as compare_rides
from .joining.joined import Joined as Joined, join_track as join_track, write_joined as write_joined
from .joining.track import Track as Track, read_track as read_track
from .logs.log import Log as Log, Stretch as Stretch
from .logs.reader import cut_log as cut_log, read_log as read_log, write_log as write_log
from .overlay.overlay import Overlaid as Overlaid, overlay as overlay
from .replay.replay import LeanTable as LeanTable, replay as replay
from .web.site import site_files as site_files, write_site as write_site

SimulatedRide, simulate_ride = _simulation.SimulatedRide, _simulation.ride

# Without __all__, pydoc would leave out imported names.
__all__ = [name for name in dir() if not name.startswith("_")]  # pyright: ignore[reportUnsupportedDunderAll]
