"""The fleet's functions for a notebook or a cluster. kickstand_tools.api has the functions for single rides.

    from kickstand_fleet import api

    fleet = api.run_fleet(api.read_manifest("MANIFEST.csv"), "results")
    print(fleet.seen.statuses)

The functions return data and print nothing. If the input is wrong, they raise InputError with one line of text.
"""

from kickstand_tools.common.messages import InputError as InputError

from .manifest import Period as Period, by_pattern as by_pattern, read_manifest as read_manifest
from .period import PeriodResult as PeriodResult, work_on_period as work_on_period
from .run import FleetRun as FleetRun, run_fleet as run_fleet

# All names imported above. Without this list pydoc leaves out imported names
__all__ = [name for name in dir() if not name.startswith("_")]  # pyright: ignore[reportUnsupportedDunderAll]
