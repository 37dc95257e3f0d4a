"""Recorded drives through the firmware's alignment: bins of samples, the gyro's bias, poses, remarks and refusals."""

import functools

import numpy as np
import pytest
from kickstand.drive_alignment import alignment
from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.rotation import matrix
from kickstand_sim.simulation.scripted.sensor_errors import random_mounting
from kickstand_tools.calibration.drive import fit_drive, fit_logs
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.messages import InputError, RefusedInput
from kickstand_tools.logs.log import Log
from support import driving_runs

NAN = float("nan")
MOUNT = np.reshape(random_mounting(5), (3, 3))
BIAS = [0.5, -1.0, 0.3]
CALIBRATION = CalibrationFile(accel_offset_g=np.array([0.02, -0.01, 0.03]), accel_slope=np.array([1.01, 0.99, 1.0]))


@functools.cache
def samples(vehicle, events):
    rows = list(driving_runs.samples([driving_runs.STAND, *driving_runs.around(events)], vehicle, tilt_deg=1.0))
    return *(np.array([row[k] for row in rows]) @ MOUNT for k in (0, 1)), np.array([row[2] for row in rows])


def driven(vehicle="car", events=7, step=50, jitter_s=0.0, name="ride"):
    """Return the log of a drive at 100 Hz. step: number of samples between two speeds."""
    force, rate, mps = samples(vehicle, events)
    n = len(mps)
    t_s = np.arange(n) / 100.0 + np.random.default_rng(5).uniform(0.0, jitter_s + 1e-9, n)
    speed = np.where(np.arange(n) % step == 3, mps, NAN)
    return Log(t_s, force, rate + BIAS, speed, name=name)


def angle_deg(a, b):
    return np.degrees(np.linalg.norm(a - b) / np.sqrt(2.0))


@pytest.mark.parametrize(("every", "gap"), [(51, True), pytest.param(21, False, marks=pytest.mark.long)])
def test_bins_give_the_board_s_matrix(every, gap):
    """The board takes each sample. Its alignment has the same matrix, counts and quality."""
    log = driven(events=9, step=every, jitter_s=0.003)
    if gap:
        log = log.part((log.t_s < 70.0) | (log.t_s > 71.3))
    fit = fit_logs([log], CALIBRATION, "car")
    bias = (fit.calibration.gyro_bias_dps - CALIBRATION.gyro_bias_dps).tolist()
    board, firmware = DriveAlignment("car", None, bias), CALIBRATION.to_firmware()
    force, rate, previous_us = [0.0] * 3, [0.0] * 3, 0
    for now_us, reading, speed in log.rows():
        firmware.apply(reading, force, rate)
        board.update(force, rate, now_us - previous_us)
        previous_us = now_us
        if speed == speed:
            board.measure_speed(speed)
    board.finish()
    out = matrix()
    board.matrix(out)
    assert angle_deg(fit.calibration.vehicle_from_sensor, np.reshape(out, (3, 3))) < 0.05
    assert (fit.used, fit.turned, fit.stops) == (board.counted, board.turned, board.standing.stops)
    assert fit.quality_deg == pytest.approx(board.quality_deg, abs=0.02)


def test_a_car_is_aligned_by_its_drive():
    log, finished, events = driven(), [], []
    fit = fit_logs([log], None, None, "improved", lambda *step: finished.append(step), events.append)
    aligned = fit.calibration
    assert angle_deg(aligned.vehicle_from_sensor, MOUNT) < 1.2
    assert aligned.gyro_bias_dps == pytest.approx(BIAS, abs=0.02)
    assert (aligned.aligned, aligned.vehicle, aligned.trim_deg, aligned.kickstand_side) == (True, "car", 0.0, "")
    assert (fit.status, fit.reason, fit.refusal, fit.poses) == ("aligned", "", None, None)
    assert 5 <= fit.used <= 8 and fit.turned == 0 and fit.stops >= 1
    assert fit.quality_deg < 3.0 and fit.attitude_deg == pytest.approx(np.hypot(fit.quality_deg, 1.1))
    assert fit.lag_s == pytest.approx(0.0, abs=0.3) and fit.halves_deg is not None and fit.halves_deg < 3.0
    (ready_s,) = [event.t_s for event in events if event.what == "ready"]
    assert fit.ready_s == ready_s and events == fit.events
    assert finished == sorted(finished) and finished[-1] == (2 * len(log.t_s),) * 2


def test_a_gyro_that_was_calibrated_has_its_bias_as_a_reading():
    """The rates of this gyro are too small by a half, and 2 deg/s of its bias are already known."""
    log = driven(events=6)
    log.gyro_dps = log.gyro_dps / 2.0 + [0.0, 2.0, 0.0]
    earlier = CalibrationFile(gyro_matrix=2.0 * np.eye(3), gyro_bias_dps=np.array([0.0, 2.0, 0.0]))
    assert fit_logs([log], earlier, "car").calibration.gyro_bias_dps == pytest.approx([0.25, 1.5, 0.15], abs=0.02)


@pytest.mark.parametrize(
    ("yaw_deg", "expected", "error_deg"), [(10.0, alignment.REFINED, -10.0), (180.0, alignment.REVERSED, 180.0)]
)
def test_two_poses_are_compared_with_the_drive(yaw_deg, expected, error_deg):
    """The alignment from the poses is turned to the left about the vertical by yaw_deg."""
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    turned = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]) @ MOUNT
    notes = {"board": "Raspberry Pi Pico", "sensor": "MPU6050"}
    earlier = CalibrationFile(
        vehicle_from_sensor=turned, aligned=True, kickstand_side="left", trim_deg=1.0, notes=notes
    )
    fit = fit_logs([driven("motorcycle", 6)], earlier)
    assert fit.vehicle == fit.calibration.vehicle == "motorcycle" and fit.calibration.kickstand_side == ""
    assert fit.calibration.notes == notes and fit.poses and fit.poses.verdict == expected
    assert (fit.poses.yaw_deg - error_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1.5)


def test_a_refusal_is_in_the_result_with_its_counts():
    logs = [driven(events=1), driven(events=1, name="other")]
    logs[0].notices, logs[1].notices = ["first"], ["second", "third"]  # type: ignore[list-item]
    fit = fit_logs(logs, CALIBRATION, "car")
    assert (fit.status, fit.reason, fit.calibration) == ("refused", "few-events", CALIBRATION)
    assert fit.stops == 2 and 0 < fit.used < 5 and fit.bias_dps == pytest.approx(BIAS, abs=0.02)
    assert fit.notices == [("ride", "first"), ("other", "second"), ("other", "third")]
    published = fit_logs([driven(events=1)], None, "car", "published")
    assert (published.method, published.lag_s, published.halves_deg, published.poses) == ("published", None, None, None)


def test_a_refused_drive_names_its_logs():
    logs = [driven(events=1), driven(events=1, name="other")]
    with pytest.raises(RefusedInput, match=r"^ride, other: .*taken for a car: else --vehicle motorcycle"):
        fit_drive(logs)
    with pytest.raises(RefusedInput) as refused:
        fit_drive(logs, vehicle="car")
    assert "taken for a car" not in str(refused.value)
    logs[1].speed_mps[:] = NAN
    with pytest.raises(InputError, match=r"^other: no speed.*or leave this log out$"):
        fit_drive(logs)


@pytest.mark.parametrize("until_s", [6.0, 1e9])
def test_accelerations_of_nearly_zero_are_refused(until_s):
    log = driven(events=1)
    log.accel_g = np.where(log.t_s[:, None] < until_s, 0.0, log.accel_g)
    with pytest.raises(InputError, match=r"^ride, at \d+\.\d s: accelerations of nearly 0: at rest 1 g is needed"):
        fit_logs([log], None, "car")
