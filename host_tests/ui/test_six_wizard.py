"""The six positions on the display measure the gyro's bias."""

from types import SimpleNamespace

import pytest
from kickstand_tools.simulated_board.simulator import Board

UPS = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0.6, 0.0, 0.8]]


def test_the_bias_is_the_mean_of_all_seven_poses(monkeypatch):
    """The rates about x in the poses are 1, 2, ... 7, and their mean is 4. The rates about y are -2, -4, ... -14, and
    their mean is -8."""
    saved, chip = [], SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)
    fit = SimpleNamespace(offset=[0.0] * 3, slope=[1.0] * 3, unproved=(), matrices=lambda: None, run=lambda: iter(()))
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0)):
        from kickstand.calibration import sensor_fit
        from kickstand.ui import six_wizard

        monkeypatch.setattr(sensor_fit, "SensorFit", lambda *_: fit)
        monkeypatch.setattr(six_wizard, "six_position_calibration", lambda offset, slope, bias, _: bias)
        wizard = six_wizard.SixWizard(chip, 200, SimpleNamespace(value=None, save=saved.append))
        for k, up in enumerate(UPS, 1):
            wizard._side = min(k, 6) - 1
            wizard._pose_done(SimpleNamespace(accel=up, gyro=[float(k), -2.0 * k, 0.5]), 1000 * k)
        wizard._followed(9000)
    assert saved == [pytest.approx([4.0, -8.0, 0.5])]
