"""Names of the firmware and the tools until 0.4, for scripts outside this repository that use the support of these
tests."""

import importlib.util
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import PathFinder
from pathlib import Path

from kickstand_tools.simulated_board import EarlierNames

STATUS = "kickstand.status_report"  # support/status_report.py
MOVED = {
    "kickstand.rides.ride_paths": "kickstand.rides.ride_files",
    "kickstand_sim.simulation.physics.kinematics": "kickstand_sim.simulation.physics.bike",
    "kickstand_sim.simulation.physics.mount": "kickstand_sim.simulation.physics.chip",
    "kickstand_tools.analysis.channels": "kickstand_tools.analysis.ride",
    "kickstand_tools.estimation.first_guess": "kickstand_tools.estimation.alignment",
    "kickstand_tools.logs.csv_lines": "kickstand_tools.logs.reader",
    "kickstand_tools.calibration.procedure": "kickstand_tools.calibration.poses",
    "kickstand_tools.imports.join": "kickstand_tools.imports.recording",
    "kickstand_tools.replay.meter_along": "kickstand_tools.replay.replay",
    "kickstand_tools.rides.block_reader": "kickstand_tools.rides.ride_log",
    "kickstand_tools.rides.record": "kickstand_tools.rides.stream",
    "kickstand_tools.common.errors": "kickstand_tools.common.messages",
    "kickstand_tools.common.progress": "kickstand_tools.cli.common",
    "kickstand_tools.common.times": "kickstand_tools.common.markup",
    "kickstand_tools.deploy.board_console": "kickstand_tools.deploy.connection",
    "kickstand_tools.deploy.bytecode": "kickstand_tools.deploy.firmware_files",
    "kickstand_tools.deploy.config_check": "kickstand_tools.deploy.config_file",
    "kickstand_tools.simulation": "kickstand_sim.simulation",
    "kickstand_tools.demo": "kickstand_sim.demo",
    "kickstand_workshop.bench": "kickstand_emulator",
    "kickstand_emulator.i2c_controller": "kickstand_emulator.chip",
    "kickstand_fleet.show": "kickstand_fleet",
    "kickstand_fleet.simulation.route": "kickstand_fleet.simulation.drive",
    "kickstand_fleet.simulation.vehicle": "kickstand_fleet.simulation.drive",
}


class _Status(MetaPathFinder):
    def find_spec(self, fullname, path, target=None):
        if fullname == STATUS:
            return importlib.util.spec_from_file_location(fullname, Path(__file__).with_name("status_report.py"))
        return None


def _take_earlier_argument(module):
    class ActiveCalibration(module.ActiveCalibration):
        def __init__(self, meter, _changed=None):
            super().__init__(meter)

    module.ActiveCalibration = ActiveCalibration


def _show_earlier_work(module):
    class LeanFilter(module.LeanFilter):
        @property
        def _work(self):
            return self._state.work

        @_work.setter
        def _work(self, work):
            self._state.work = work

    module.LeanFilter = LeanFilter


CHANGED = {
    "kickstand.calibration.active": _take_earlier_argument,
    "kickstand.lean.lean_filter": _show_earlier_work,
}


class _Changed(MetaPathFinder, Loader):
    """Changes a module of CHANGED after its import."""

    def find_spec(self, fullname, path, target=None):
        spec = PathFinder.find_spec(fullname, path) if fullname in CHANGED else None
        if spec and spec.loader:
            self._loader: Loader = spec.loader
            spec.loader = self
        return spec

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        self._loader.exec_module(module)
        CHANGED[module.__name__](module)


_FINDERS = [_Status(), _Changed(), EarlierNames(MOVED)]


def install():
    if _FINDERS[0] not in sys.meta_path:
        sys.meta_path[:0] = _FINDERS
