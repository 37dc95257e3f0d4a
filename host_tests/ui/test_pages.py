"""The text of each page: units, signs, rounding, and 16 characters per line. Also the page of a drive."""

from typing import Any

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.drive_alignment import alignment
from kickstand.errors import Notice, Refusal
from panel import Panel, pages, reading

D = "\xdf"


def meter(**values) -> Any:
    fake_meter = reading((0, 0, 0, 0, 0, 0, 0))
    vars(fake_meter).update(values)
    return fake_meter


@pytest.mark.parametrize(
    ("page", "values", "lines"),
    [
        ("lean", {"lean_deg": 0.4}, f"Lean   0{D} "),
        ("lean", {"lean_deg": 0.5}, f"Lean   1{D} right"),
        ("lean", {"lean_deg": -0.4}, f"Lean   0{D} "),
        ("lean", {"lean_deg": -32.6}, f"Lean  33{D} left"),
        ("maxima", {"max_left_deg": 30.4, "max_right_deg": 41.5}, (f"Max left    30{D}", f"Max right   42{D}")),
        ("maxima", {"max_left_deg": 30.6, "max_right_deg": 41.4}, (f"Max left    31{D}", f"Max right   41{D}")),
        ("acceleration", {"forward": 0.312}, ("Accel    0.31 g", "pk +0.42 / -0.91")),
        ("acceleration", {"forward": -0.004}, ("Accel    0.00 g", "pk +0.42 / -0.91")),
        ("acceleration", {"forward": -0.006}, ("Brake    0.01 g", "pk +0.42 / -0.91")),
        ("acceleration", {"forward": -0.85}, ("Brake    0.85 g", "pk +0.42 / -0.91")),
        ("cornering", {"left": 0.31}, ("Left     0.31 g", "Up       1.02 g")),
        ("cornering", {"left": -0.42}, ("Right    0.42 g", "Up       1.02 g")),
        ("cornering", {"left": 0.006}, ("Left     0.01 g", "Up       1.02 g")),
        ("cornering", {"left": 0.004}, ("Right    0.00 g", "Up       1.02 g")),
        # Nicolae's formula at rest: the lean is arcsin(0.5 g)
        ("formula", {"force": [0.5, 0.866, 0.0], "lean_deg": 12.4}, (f"Formula     30{D}", f"Filter      12{D}")),
    ],
)
def test_lines_of_a_page(page, values, lines):
    values = {"smooth_force": [values.pop("left", 0.0), 1.02, values.pop("forward", 0.0)]} | values
    drawn = getattr(pages, page)(
        meter(max_accel_g=0.42, max_brake_g=0.91, **values) if page == "acceleration" else meter(**values)
    )
    assert drawn == lines if isinstance(lines, tuple) else drawn[0] == lines


@pytest.mark.parametrize(
    ("lean_deg", "bar"),
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
def test_a_column_of_the_bar_is_one_and_a_half_degrees(lean_deg, bar):
    """ "#" is a full cell. "1" to "4" is a cell whose first columns from the left are filled, "a" to "d" from the
    right."""
    names = {0x20: " ", 0xFF: "#"} | {k: "1234abcd"[k] for k in range(8)}
    assert "".join(names[code] for code in pages.lean(meter(lean_deg=lean_deg))[1]) == bar


def test_the_raw_page_is_calibrated_and_not_turned():
    """With 4096 counts per g and 65.5 counts per deg/s."""
    counts = [2048, -4096, 1024, 0, 6550, -655, 131]
    assert pages.raw(reading(counts)) == (" 0.50-1.00 0.25g", f" 100 -10   2 {D}/s")
    calibration = Calibration()
    calibration.set_accel((0.1, 0.0, 0.0), (1.0, 1.0, 2.0))
    turned = calibration.with_alignment((0, 1, 0, 0, 0, 1, 1, 0, 0), (0.0, 3.0, 0.0))
    assert pages.raw(reading(counts, turned)) == (" 0.60-1.00 0.50g", f" 100 -13   2 {D}/s")


def test_before_alignment_tilt_and_g_are_the_sensors_own():
    """The page shows "Not aligned" and the next step in turn, for two seconds each."""
    fake_meter = meter(smooth_force=[0.5, 0.866, -0.25])
    lines = [pages.not_aligned(fake_meter, seconds, "todo") for seconds in range(5)]
    assert lines == [(f"Raw   30{D} -0.25g", hint) for hint in ["Not aligned"] * 2 + ["todo"] * 2 + ["Not aligned"]]


class Recorder:
    """The two values of a recording that its page shows."""

    def __init__(self, seconds, room_s):
        self.seconds, self.room_s = (lambda: seconds), (lambda: room_s)


@pytest.mark.parametrize(
    ("seconds", "room_s", "lines"),
    [
        (0, None, ("Rec         0:00", "to USB")),
        (59, 0, ("Rec         0:59", "oldest is erased")),
        (60, 59, ("Rec         1:00", "room 0 min")),
        (3661, 35_999, ("Rec        61:01", "room 599 min")),
        (3661, 36_000, ("Rec        61:01", "room 10 h")),
    ],
)
def test_recording_shows_its_duration_and_the_time_left(seconds, room_s, lines):
    assert pages.recording(Recorder(seconds, room_s)) == lines


DONE = Notice("aligned", 0.4)
BRAKE, SPEED = {"state": alignment.WAITING_FOR_BRAKING}, {"state": alignment.WAITING_FOR_SPEED}


@pytest.mark.parametrize(
    ("values", "result", "fault", "lines"),
    [
        (BRAKE, None, None, ("Brakings   2/5", "brake straight")),
        ({"state": alignment.BRAKING}, None, None, ("Brakings   2/5", "braking...")),
        ({"state": alignment.TURNING}, None, None, ("Brakings   2/5", "braking...")),  # at walking pace
        ({"state": alignment.WAITING_FOR_STOP, "counted": 0}, None, None, ("Brakings   0/5", "stop needed")),
        (SPEED, None, None, ("Align by drive", "waiting: speed")),
        (SPEED, None, Notice("no-pulse"), ("Wheel: no pulse", "ride, or wiring?")),
        (BRAKE, None, Notice("no-pulse"), ("Brakings   2/5", "brake straight")),
        (BRAKE | {"counted": 6}, None, None, (f"Brake  6 +- 1.2{D}", "brake straight")),
        (BRAKE | {"counted": 6, "quality_deg": 180.0}, None, None, (f"Brake  6 +-99.9{D}", "brake straight")),
        ({"state": alignment.READY, "counted": 6}, None, None, ("Ready:", "stop to save it")),
        (BRAKE | {"problem": Refusal("speed-negative")}, DONE, None, ("Speed negative", "Check its source")),
        # The page shows the last result until new braking events count.
        (BRAKE | {"counted": 0}, DONE, None, ("Aligned by drive", f"error about 0.4{D}")),
        (BRAKE | {"counted": 1}, DONE, None, ("Brakings   1/5", "brake straight")),
        (BRAKE | {"counted": 6, "ready": True}, DONE, None, ("Aligned by drive", f"error about 0.4{D}")),
    ],
)
def test_each_state_of_a_drive_has_its_lines(values, result, fault, lines):
    state = {"counted": 2, "problem": None, "ready": False, "quality_deg": 1.2} | values
    from kickstand.ui.drive_page import drive as page  # needs the clock of the board

    drive: Any = Panel(SPEED="wheel").app.drive
    drive.drive = type("Drive", (alignment.DriveAlignment,), state)(alignment.MOTORCYCLE)
    drive.result = result
    drive.speed.source.fault = lambda now_ms: fault
    assert page(drive, 0) == lines
