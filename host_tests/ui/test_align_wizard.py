"""The two presses measure the gyro's bias."""

from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.simulator import Board


@pytest.mark.parametrize(("waited_ms", "fresh"), [(5_000, True), (100_000, False)])
def test_an_old_bias_is_not_treated_as_known(monkeypatch, waited_ms, fresh):
    saved, chip = [], SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)
    calibration = SimpleNamespace(value=None, save=lambda new, posed: saved.append(posed))
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0)):
        from kickstand.ui import align_wizard

        monkeypatch.setattr(align_wizard, "align", lambda *_: ("aligned", 12.0))
        monkeypatch.setattr(align_wizard, "check_turn", lambda *_: None)
        wizard = align_wizard.AlignWizard(chip, 200, calibration, "left")
        wizard._pose_done(SimpleNamespace(gyro=[0.0] * 3), 1000)
        wizard._pose_done(SimpleNamespace(gyro=[0.0] * 3), 1000 + waited_ms)
    assert saved == [fresh]
