"""One simulated fleet with its results, shared by all tests, and workers inside the test process."""

import copy

import fleet_drives
import pytest
import stores
from kickstand_fleet import run
from kickstand_fleet.manifest import read_manifest
from kickstand_fleet.period import work_on_period


@pytest.fixture(scope="session")
def fleet(tmp_path_factory):
    """Return a SimulatedFleet of nine vehicles, some of which have a fault."""
    return fleet_drives.simulate(tmp_path_factory.mktemp("fleet"))


@pytest.fixture(scope="session")
def periods(fleet):
    return read_manifest(str(fleet.manifest))


@pytest.fixture(scope="session")
def results(periods):
    """Return {vehicle: PeriodResult}."""
    return {period.vehicle: work_on_period(period) for period in periods}


class Workers:
    """Runs the tasks in this process.

    outcomes: {vehicle: outcome} for tasks that are not computed. An outcome is a PeriodResult, a (reason, explanation)
        of a task that failed, or an error that ends the run.
    after: called after each task.
    """

    def __init__(self):
        self.outcomes, self.after = {}, lambda: None

    def run_tasks(self, function, items, *_):
        for index, item in enumerate(items):
            outcome = self.outcomes.get(item[0].vehicle) or function(*item)
            self.after()
            if isinstance(outcome, BaseException):
                raise outcome
            if isinstance(outcome, tuple):
                yield index, None, *outcome
            else:
                yield index, copy.deepcopy(outcome), "", ""


@pytest.fixture
def workers(monkeypatch):
    """Replace Dask's workers by Workers."""
    replacement = Workers()
    monkeypatch.setattr(run, "run_tasks", replacement.run_tasks)
    return replacement


@pytest.fixture
def store():
    """Return a store at failing://, empty."""
    stores.FailingStore.clear()
    yield stores.FailingStore
    stores.FailingStore.clear()
