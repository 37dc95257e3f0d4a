"""The text of each page: units, signs, rounding, and 16 characters per line."""

import types

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.errors import Notice
from kickstand.lean.meter import LeanMeter
from kickstand.ui import pages

DEGREE = pages.DEGREE
FULL = "#"


def bar(lean_deg):
    """Return the lean's bar as text.

    "#" is a full cell and a space is an empty cell. "1" to "4" is a cell whose first 1 to 4 columns from the left are
    filled. "a" to "d" is a cell whose first 1 to 4 columns from the right are filled.
    """
    names = {0x20: " ", 0xFF: FULL, **{i: str(i + 1) for i in range(4)}, **{4 + i: "abcd"[i] for i in range(4)}}
    return "".join(names[code] for code in pages.lean_bar(lean_deg))


@pytest.mark.parametrize("what", ["left", "up", "tilt"])
def test_an_odd_sensor_is_reported_instead_of_its_lean(what):
    code = "odd-pitch" if what == "tilt" else "odd-" + what
    assert pages.unsure(code) == ("Lean  --", "sensor odd: " + what)
    assert len(pages.unsure(code)[1]) <= 16


def meter(**values):
    return types.SimpleNamespace(**values)


def measured(counts, calibrate=None):
    """Return a meter after one reading. counts: the reading, with 4096 counts per g and 65.5 counts per deg/s."""
    from array import array

    calibration = Calibration()
    if calibrate:
        calibrate(calibration)
    calibration.set_scale(4096, 65.5)
    shown = LeanMeter(calibration)
    shown.update_sum(array("i", counts), 1, 0)
    return shown


def test_the_raw_page_shows_g_and_rates_in_the_sensors_axes():
    counts = [2048, -4096, 1024, 0, 6550, -655, 131]
    assert pages.raw(measured(counts)) == (" 0.50-1.00 0.25g", f" 100 -10   2 {DEGREE}/s")


def test_the_raw_page_is_calibrated_and_not_turned():
    def calibrate(calibration):
        calibration.set_accel((0.1, 0.0, 0.0), (1.0, 1.0, 2.0))
        calibration.gyro_bias[1] = 3.0
        for i, value in enumerate((0, 1, 0, 0, 0, 1, 1, 0, 0)):
            calibration.vehicle_from_sensor[i] = value

    counts = [2048, -4096, 1024, 0, 6550, -655, 131]
    assert pages.raw(measured(counts, calibrate)) == (" 0.60-1.00 0.50g", f" 100 -13   2 {DEGREE}/s")


@pytest.mark.parametrize(
    ("lean_deg", "line"),
    [
        (0.4, "Lean   0° "),
        (0.5, "Lean   1° right"),
        (-0.4, "Lean   0° "),
        (-0.5, "Lean   1° left"),
        (32.4, "Lean  32° right"),
        (-32.6, "Lean  33° left"),
    ],
)
def test_the_lean_is_rounded_and_has_its_side(lean_deg, line):
    assert pages.lean(meter(lean_deg=lean_deg))[0] == line.replace("°", DEGREE)


@pytest.mark.parametrize(
    ("lean_deg", "shown"),
    [
        (0.0, "       a1       "),
        (1.5, "       a1       "),
        (2.3, "       a2       "),
        (-2.2, "       a1       "),
        (-2.3, "       b1       "),
        (7.5, "       a#       "),
        (-12.0, "      c#1       "),
        (30.0, "       a####    "),
        (59.0, "       a#######4"),
        (60.0, "       a########"),
        (-75.0, "########1       "),
    ],
)
def test_a_column_of_the_bar_is_one_and_a_half_degrees(lean_deg, shown):
    assert bar(lean_deg) == shown


@pytest.mark.parametrize(
    ("done", "total", "cells"), [(0, 100, 0), (1, 100, 0), (7, 100, 1), (50, 100, 8), (99, 100, 15), (100, 100, 16)]
)
def test_progress_fills_sixteen_cells(done, total, cells):
    assert pages.progress_bar(done, total) == "\xff" * cells


def test_progress_beyond_its_limits_fits_the_display():
    assert pages.progress_bar(0, 0) == pages.progress_bar(5, 0) == ""
    assert pages.progress_bar(300, 100) == "\xff" * 16


def recorder(seconds, room_s):
    return types.SimpleNamespace(seconds=lambda: seconds, room_s=lambda: room_s)


@pytest.mark.parametrize(
    ("seconds", "room_s", "lines"),
    [
        (0, None, ("Rec         0:00", "to USB")),
        (59, 0, ("Rec         0:59", "oldest is erased")),
        (60, 59, ("Rec         1:00", "room 0 min")),
        (3661, 1140, ("Rec        61:01", "room 19 min")),
        (3661, 35_999, ("Rec        61:01", "room 599 min")),
        (3661, 36_000, ("Rec        61:01", "room 10 h")),
    ],
)
def test_recording_shows_its_duration_and_the_time_left(seconds, room_s, lines):
    assert pages.recording(recorder(seconds, room_s)) == lines


def test_a_recorded_line_has_its_star_in_the_last_column():
    assert pages.recorded("Lean  32" + DEGREE) == "Lean  32" + DEGREE + "      *"
    assert pages.recorded("x" * 15) == "x" * 15 + "*"


def test_maxima_are_rounded_each_on_its_line():
    for left, right, words in ((30.4, 41.5, ("30", "42")), (30.6, 41.4, ("31", "41"))):
        shown = pages.maxima(meter(max_left_deg=left, max_right_deg=right))
        assert shown == (f"Max left    {words[0]}{DEGREE}", f"Max right   {words[1]}{DEGREE}")


@pytest.mark.parametrize(
    ("forward", "line"),
    [
        (0.312, "Accel    0.31 g"),
        (-0.004, "Accel    0.00 g"),
        (-0.006, "Brake    0.01 g"),
        (-0.85, "Brake    0.85 g"),
    ],
)
def test_speeding_up_and_braking_have_their_words(forward, line):
    shown = meter(smooth_force=[0.5, 0.9, forward], max_accel_g=0.42, max_brake_g=0.91)
    assert pages.acceleration(shown) == (line, "pk +0.42 / -0.91")


@pytest.mark.parametrize(
    ("left", "line"),
    [(0.31, "Left     0.31 g"), (-0.42, "Right    0.42 g"), (0.006, "Left     0.01 g"), (0.004, "Right    0.00 g")],
)
def test_a_car_has_a_side_and_an_up(left, line):
    assert pages.cornering(meter(smooth_force=[left, 1.02, 0.3])) == (line, "Up       1.02 g")


def test_the_formula_is_shown_beside_the_filter():
    shown = pages.formula(meter(lean_formula_deg=-7.6, lean_deg=12.4))
    assert shown == (f"Formula     -8{DEGREE}", f"Filter      12{DEGREE}")


def test_before_alignment_tilt_and_g_are_the_sensors_own():
    """The page shows "Not aligned" and the next step in turn, for two seconds each."""
    shown = meter(smooth_force=[0.5, 0.866, -0.25])
    lines = [pages.not_aligned(shown, seconds) for seconds in range(5)]
    assert {line for line, _ in lines} == {f"Raw   30{DEGREE} -0.25g"}
    assert [hint for _, hint in lines] == ["Not aligned"] * 2 + ["On stand: press"] * 2 + ["Not aligned"]
    assert pages.not_aligned(shown, 3, "Drive: brake")[1] == "Drive: brake"


def test_the_sensor_page_of_a_fault_lists_the_devices():
    sensor = types.SimpleNamespace(fault=Notice("no-sensor"), found=[0x27, 0x68, 0x77])
    seen = [pages.sensor_info(sensor, 0, meter(), seconds) for seconds in range(5)]
    fault, there = ("No sensor", "check wiring"), ("On its I2C bus:", "27 68 77")
    assert seen == [fault, fault, there, there, fault]
    sensor.found = []
    assert pages.sensor_info(sensor, 0, meter(), 2) == ("On its I2C bus:", "nothing")


def test_the_sensor_page_counts_gaps_starts_and_lost_samples():
    """The page shows each count for two seconds."""
    chip = types.SimpleNamespace(name="MPU6050", temperature_c=lambda counts: counts / 10.0, overflows=3, address=0x69)
    calibration = types.SimpleNamespace(six_done=True, aligned=False)
    shown = meter(reading=[1, 2, 3, 285, 5, 6, 7], calibration=calibration)
    sensor = types.SimpleNamespace(chip=chip, restarts=1, fault=None)
    seen = [pages.sensor_info(sensor, 0, shown, seconds) for seconds in range(9)]
    assert {line1 for line1, _ in seen} == {f"MPU6050   28.5{DEGREE}C"}
    words = ["6pos yes ali no", "3 gaps 1 starts", "samples lost   0", "I2C address 0x69"]
    assert [line2 for _, line2 in seen] == [words[seconds // 2 % 4] for seconds in range(9)]
    chip.overflows, sensor.restarts, chip.name = 12345, 678, "MPU6050 clone"
    assert pages.sensor_info(sensor, 123456, shown, 2)[1] == "99 gaps 9 starts"
    assert pages.sensor_info(sensor, 123456, shown, 4)[1] == "samples lost9999"
    assert pages.sensor_info(sensor, 123456, shown, 0)[0] == f"MPU6050 c 28.5{DEGREE}C"
