"""Which logs `calibrate drive` uses, and which vehicle it assumes."""

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import CAR
from kickstand_tools.calibration.drive import fit_drive, usable
from kickstand_tools.common.messages import InputError, RefusedInput
from kickstand_tools.logs.log import Log


def noisy(step_s=0.05, speed=9.0):
    noise = np.random.default_rng(1).normal(size=(100, 3))
    return Log(np.linspace(0.0, 99.0 * step_s, 100), noise, noise, np.full(100, speed), name="n")


@pytest.mark.parametrize(
    ("log", "others", "words"),
    [
        (noisy(0.0501), False, r"n: a sample every 0\.05 s: at least 20 per second"),
        (noisy(speed=np.nan), False, "a wheel$"),
        (noisy(speed=np.nan), True, "or leave this log out$"),
    ],
)
def test_a_log_needs_a_speed_and_20_samples_a_second(log, others, words):
    assert usable(noisy(), others) is not None
    with pytest.raises(InputError, match=words):
        usable(log, others)


STANDING = Log(np.arange(300) / 100.0, np.tile([0.0, 1.0, 0.0], (300, 1)), np.zeros((300, 3)), np.zeros(300))


def test_a_refused_drive_raises():
    with pytest.raises(RefusedInput):
        fit_drive([STANDING], vehicle=CAR)
