"""Names of the firmware until 0.4, for scripts outside this repository that use the support of these tests."""

import importlib.util
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

STATUS = "kickstand.status_report"  # support/status_report.py
PATHS = "kickstand.rides.ride_paths"  # kickstand.rides.ride_files


class _Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == STATUS:
            return importlib.util.spec_from_file_location(name, Path(__file__).with_name("status_report.py"))
        return ModuleSpec(name, _Finder) if name == PATHS else None

    @staticmethod
    def create_module(spec):
        from kickstand.rides import ride_files

        return ride_files

    @staticmethod
    def exec_module(module):
        pass


def install():
    if _Finder not in sys.meta_path:
        sys.meta_path.append(_Finder)
