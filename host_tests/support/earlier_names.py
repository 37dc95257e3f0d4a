"""Names of the firmware until 0.4, for scripts outside this repository that use the support of these tests."""

import importlib.util
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path

STATUS = "kickstand.status_report"  # support/status_report.py
PATHS = "kickstand.rides.ride_paths"  # kickstand.rides.ride_files


class _Finder(MetaPathFinder, Loader):
    def find_spec(self, fullname, path, target=None):
        if fullname == STATUS:
            return importlib.util.spec_from_file_location(fullname, Path(__file__).with_name("status_report.py"))
        return ModuleSpec(fullname, self) if fullname == PATHS else None

    def create_module(self, spec):
        from kickstand.rides import ride_files

        return ride_files

    def exec_module(self, module):
        pass


_FINDER = _Finder()


def install():
    if _FINDER not in sys.meta_path:
        sys.meta_path.append(_FINDER)
