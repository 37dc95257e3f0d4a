"""One small fleet and one run over it for all tests of a module, because both take seconds."""

import made_fleet
import pytest
from kickstand_fleet import run


@pytest.fixture(scope="session")
def fleet(tmp_path_factory):
    """A MadeFleet of nine vehicles, several of which have a problem."""
    return made_fleet.make(tmp_path_factory.mktemp("fleet"))


@pytest.fixture
def alone(monkeypatch):
    """Process vehicles in this process."""
    monkeypatch.setattr(run, "run_tasks", made_fleet.in_this_process)
