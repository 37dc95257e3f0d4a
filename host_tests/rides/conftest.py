"""A simulated clock and the flash of a board, for tests of the modules in kickstand/rides."""

import types

import pytest
from kickstand.rides import ride_files
from kickstand_sim.simulated_board.clock import Clock
from kickstand_sim.simulated_board.fakes import fake_os, fake_time
from rings import KB_4, opened


@pytest.fixture
def clock(monkeypatch):
    """Return the clock of the board. Power-on was 3 s ago."""
    clock = Clock()
    fake_time.use(clock, 0)
    for name in fake_time.ADDED:
        monkeypatch.setattr("time." + name, getattr(fake_time, name), raising=False)
    clock.advance(3_000_000)
    return clock


@pytest.fixture
def root(tmp_path, monkeypatch):
    """Yield the flash of a board: space.free bytes of space.all are free."""
    space = types.SimpleNamespace(free=400 * KB_4, all=500 * KB_4, path=tmp_path)

    def statvfs(_path):
        return 512, KB_4, space.all // KB_4, space.free // KB_4, 0, 0, 0, 0, 0, 255

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("os.statvfs", statvfs, raising=False)
    monkeypatch.setattr("os.ilistdir", fake_os.ilistdir, raising=False)
    monkeypatch.setattr(ride_files, "directory", lambda settings: "rides")
    yield space
    while opened:
        opened.pop().abandon()
