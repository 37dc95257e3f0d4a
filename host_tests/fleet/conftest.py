"""Simulates one small fleet for all tests of a module, because this takes seconds."""

import made_fleet
import pytest
from kickstand_fleet import run


@pytest.fixture(scope="session")
def fleet(tmp_path_factory):
    """Return a MadeFleet of nine vehicles, some of which have a fault."""
    return made_fleet.make(tmp_path_factory.mktemp("fleet"))


@pytest.fixture
def alone(monkeypatch):
    """Run the tasks in this process instead of in workers."""
    monkeypatch.setattr(run, "run_tasks", made_fleet.in_this_process)
