"""Names of the firmware and the tools until 0.4, for scripts outside this repository that use the support of these
tests."""

import importlib.util
import sys
from importlib.abc import MetaPathFinder
from pathlib import Path

from kickstand_tools.simulated_board import EarlierNames

STATUS = "kickstand.status_report"  # support/status_report.py
MOVED = {
    "kickstand.rides.ride_paths": "kickstand.rides.ride_files",
    "kickstand_sim.simulation.physics.kinematics": "kickstand_sim.simulation.physics.bike",
    "kickstand_sim.simulation.physics.mount": "kickstand_sim.simulation.physics.chip",
    "kickstand_tools.simulation": "kickstand_sim.simulation",
    "kickstand_tools.demo": "kickstand_sim.demo",
    "kickstand_workshop.bench": "kickstand_emulator",
}


class _Status(MetaPathFinder):
    def find_spec(self, fullname, path, target=None):
        if fullname == STATUS:
            return importlib.util.spec_from_file_location(fullname, Path(__file__).with_name("status_report.py"))
        return None


_FINDERS = [_Status(), EarlierNames(MOVED)]


def install():
    if _FINDERS[0] not in sys.meta_path:
        sys.meta_path[:0] = _FINDERS
