"""The active calibration is loaded, applied and saved, and its trim is written to flash."""

import sys

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import FILES, Store
from kickstand_sim.simulated_board.simulator import Board


class Meter:
    """A lean meter without a filter. new_trim: the result of keep_trim() in degrees, or None without a new trim."""

    def __init__(self):
        self.calibration, self.posed = Calibration(), False
        self.new_trim = None
        self.used = self.resets = 0

    def use(self, calibration, posed=False):
        self.calibration, self.posed = calibration, posed
        self.used += 1

    def reset_maxima(self):
        self.resets += 1

    def keep_trim(self):
        if self.new_trim is None:
            return False
        self.calibration.trim_deg, self.new_trim = self.new_trim, None
        return True


class Chip:
    def __init__(self, who_am_i=0x68):
        self.who_am_i = who_am_i
        self.accel_range_g, self.accel_lsb_per_g, self.gyro_lsb_per_dps = 8, 4096, 65.5


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Return an ActiveCalibration at 0 ms, and its meter."""
    monkeypatch.chdir(tmp_path)
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)):
        from kickstand.calibration.active import ActiveCalibration

        meter = Meter()
        yield ActiveCalibration(meter), meter


def aligned(offset=0.0):
    calibration = Calibration()
    calibration.set_accel((offset, 0, 0), (1, 1, 1))
    calibration.aligned = True
    return calibration


def stored():
    return Store(0x68, 8).load()


def test_the_stored_calibration_of_the_chip_is_loaded_once(made):
    active, meter = made
    Store(0x68, 8).save(aligned(0.125))
    assert not active.aligned
    assert active.chip_started(Chip())
    assert active.aligned
    assert active.value is meter.calibration
    assert active.value.accel_offset[0] == 0.125
    assert (active.value.scales()[0][1], active.value.scales()[1]) == (1 / 4096, 1 / 65.5)
    assert active.changed
    active.changed = False
    assert not active.chip_started(Chip())
    assert (meter.used, meter.resets, active.changed) == (1, 1, False)
    assert active.chip_started(Chip(0x70))
    assert active.changed and not active.aligned


def test_only_a_refinement_keeps_the_maxima(made):
    active, meter = made
    active.chip_started(Chip())
    for offset, posed, refined in (0.25, True, False), (0.5 - 1 / 64, False, True):
        resets, active.changed = meter.resets, False
        active.save(aligned(offset), posed, refined)
        assert stored().accel_offset[0] == meter.calibration.accel_offset[0] == offset
        assert meter.posed is posed
        assert active.changed and (meter.resets == resets) is refined


def test_a_restart_saves_the_trim_and_uses_the_stored_values(made):
    active, meter = made
    active.chip_started(Chip())
    active.save(aligned())
    used, active.changed = meter.used, False
    meter.new_trim = 1.25
    active.restart()
    assert stored().trim_deg == active.value.trim_deg == 1.25
    assert (meter.used, active.changed) == (used + 1, False)


def test_without_its_module_loading_fails_as_an_incomplete_firmware(made, monkeypatch):
    monkeypatch.setitem(sys.modules, "kickstand.calibration.store", None)
    with pytest.raises(ImportError):
        made[0].chip_started(Chip())


def test_an_unwritable_flash_is_reported_and_retried_later(made, tmp_path, capsys):
    active, meter = made
    for name in FILES:
        (tmp_path / name).mkdir()
    active.chip_started(Chip())
    meter.calibration.aligned = True
    for now_ms, tried in (100_000, True), (159_999, False), (160_000, True):
        meter.new_trim = 1.0
        active.keep_trim(now_ms)
        assert (meter.new_trim is None) is tried
        assert capsys.readouterr().out.startswith("calibration not saved") is tried
