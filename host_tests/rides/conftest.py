"""A simulated clock, and a directory that simulates the flash, for tests of the modules in kickstand/rides."""

import types

import pytest
from kickstand.rides import flash_ring, ride_paths
from kickstand_tools.simulated_board.clock import Clock
from kickstand_tools.simulated_board.fakes import fake_os, fake_time
from rings import FLASH, KB_4


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    fake_time.use(clock, 0)
    for name in fake_time.ADDED:
        monkeypatch.setattr("time." + name, getattr(fake_time, name), raising=False)
    clock.advance(3_000_000)  # power-on was 3 s ago
    return clock


@pytest.fixture
def root(tmp_path, monkeypatch):
    """Return a directory that simulates the flash. space.free bytes of space.all are free."""
    space = types.SimpleNamespace(free=400 * KB_4, all=500 * KB_4, path=tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(flash_ring, "free_bytes", lambda _path: space.free)
    monkeypatch.setattr(flash_ring, "all_bytes", lambda _path: space.all)
    monkeypatch.setattr("os.ilistdir", fake_os.ilistdir, raising=False)
    monkeypatch.setattr(ride_paths, "directory", lambda settings: "rides" if settings is FLASH else "card")
    return space
