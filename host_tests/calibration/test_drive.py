"""Which logs `calibrate drive` uses, and which vehicle it assumes."""

import numpy as np
import pytest
from kickstand.drive_alignment.alignment import CAR, MOTORCYCLE
from kickstand_tools.calibration.drive import fit_drive, fit_logs, usable
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError, RefusedInput
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


@pytest.mark.parametrize(
    ("given", "vehicle", "kind"),
    [
        (None, None, CAR),
        (CalibrationFile(aligned=True), None, MOTORCYCLE),
        (CalibrationFile(aligned=True, vehicle="car"), None, CAR),
        (CalibrationFile(aligned=True), CAR, CAR),
        (CalibrationFile(), MOTORCYCLE, MOTORCYCLE),
    ],
)
def test_the_vehicle_follows_from_the_calibration(given, vehicle, kind):
    """A short log is refused, but the result says which vehicle was assumed."""
    found = fit_logs([STANDING], given, vehicle)
    assert (found.vehicle, found.status, found.used, found.ready_s) == (kind, "refused", 0, 0.0)
    assert found.poses is None and found.calibration == (given or CalibrationFile())
    assert ("taken for a car" in str(found.refusal)) is (vehicle is None and kind == CAR)


def test_a_refused_drive_raises():
    with pytest.raises(RefusedInput):
        fit_drive([STANDING], vehicle=CAR)
