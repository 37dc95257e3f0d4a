"""The guided calibrations: presses and samples in, the display's lines and the saved calibration out."""

import sys

import numpy as np
import pytest
from kickstand.errors import Notice
from panel import AXES, LONG, SHORT, Panel, turned

STAND, UPRIGHT = ("On the stand,", "press button"), ("Now upright:", "hold it, press")


def on_the_stand(lean_deg=12.0, **config):
    """Return a panel with an open alignment, on a bike that leans to the left on its kickstand."""
    panel = Panel(aligned=False, **config)
    panel.attitude = turned(lean_deg, (0, 1, 0))
    assert panel.choose("Align the bike") == STAND
    return panel


def take_stand(panel):
    assert panel.press(SHORT) == ("Stand: hold", "")
    assert panel.hold(2.1)[1] == "#" * 8  # half a second of stillness, and half of 3 s
    assert panel.hold(1.5) == UPRIGHT


def test_an_alignment_takes_both_poses_and_is_saved():
    """The bike leans about the sensor's y, by 12 degrees to the left. So y is along the bike."""
    panel = on_the_stand()
    take_stand(panel)
    panel.turn(-12.0, (0, 1, 0))
    assert panel.press(SHORT) == ("Upright: hold", "")
    assert panel.hold(3.6) == ("Aligned!  12.0°", "Ride safely")
    assert panel.lines(panel.now_ms + 3800)[0] == "Aligned!  12.0°"
    assert panel.lines(panel.now_ms + 200)[0].startswith("Lean") and panel.screen.wizard is None
    value = panel.app.calibration.value
    assert value.aligned and not value.by_drive
    assert list(value.vehicle_from_sensor) == pytest.approx([*AXES], abs=0.01)
    assert Panel(aligned=False).app.calibration.aligned  # from flash
    assert "kickstand.calibration.poses" not in sys.modules  # its modules take 12 KB of a board's heap


@pytest.mark.parametrize("recording", [False, True])
def test_the_lean_begins_with_the_poses_unless_a_ride_is_recorded(recording):
    """A replay of the ride does not know the poses."""
    panel, saved = on_the_stand(), []
    panel.app.calibration.save = lambda calibration, posed=False: saved.append(posed)
    if recording:
        panel.app.rides.start()
    take_stand(panel)
    panel.turn(-12.0, (0, 1, 0))
    panel.press(SHORT)
    panel.hold(3.6)
    assert saved == [not recording]


@pytest.mark.parametrize(
    ("lean_deg", "turn_deg", "lines"),
    [
        (7.5, -7.5, ("Aligned!   7.5°", "Little, 8° best")),
        (1.0, -1.0, ("Tilt only 1.0°", "Need 5° or more")),
        (65.0, -65.0, ("Tilt 65°: over", "60°, do it again")),
        (0.0, 0.0, ("Same pose twice", "Stand, then up")),
        (12.0, -24.0, ("Tilt 12°, gyro", "says 24°: redo")),
    ],
)
def test_results_and_refusals_of_an_alignment(lean_deg, turn_deg, lines):
    """A press after a refusal asks for the first pose again."""
    panel = on_the_stand(lean_deg)
    take_stand(panel)
    panel.turn(turn_deg, (0, 1, 0))
    panel.attitude = np.eye(3)
    panel.press(SHORT)
    result = panel.hold(3.6)
    assert result == lines
    if not lines[0].startswith("Aligned"):
        assert panel.hold(10.0) == result and panel.press(SHORT) == STAND
        assert not Panel(aligned=False).app.calibration.aligned  # nothing is in flash


def test_a_pose_that_is_not_still_is_taken_again():
    panel = on_the_stand()
    panel.press(SHORT)
    shaken = {"rate_dps": (30.0, 0.0, 0.0)}
    for seconds, lines in ((1.0, ("Stand: hold", "")), (0.1, ("Stand: hold", "not still yet"))):
        for k in range(round(10 * seconds)):
            panel.hold(0.05, rate_dps=(30.0 * (-1) ** k, 0.0, 0.0))
            panel.hold(0.05)
        assert panel.lines() == lines
    panel.hold(1.0)
    assert panel.hold(0.2, **shaken) == ("Moved!", "Hold it still") and panel.screen.wizard.notice.code == "moved"
    assert panel.press(SHORT) == ("Stand: hold", "") and panel.screen.wizard.notice is None
    assert panel.hold(3.6) == UPRIGHT


def test_an_alignment_ends_by_a_long_press_or_a_fault():
    """A cancelled alignment gets no more samples, not even until the next page is shown."""
    panel = on_the_stand()
    panel.press(SHORT)
    panel.screen.press(LONG, panel.now_ms)
    assert panel.screen.wizard is None and panel.lines()[0].startswith("Raw")
    panel.choose("Align the bike")
    panel.sensor.fault = Notice("clips", "Gyro")
    panel.screen.interrupt()
    assert panel.lines() == ("Calibration", "stopped: fault") and panel.screen.wizard is None


def test_without_memory_an_alignment_ends_with_a_notice(capsys):
    panel = on_the_stand()
    take_stand(panel)

    def take(k):
        raise MemoryError("memory allocation failed")

    panel.sensor.chip.take = take
    assert panel.hold(0.1) == ("No memory for it", "restart it") and panel.screen.wizard is None
    assert "no memory for that (memory allocation failed)" in capsys.readouterr().out
    assert panel.lines(panel.now_ms + 2000)[0].startswith("Raw")


def test_a_faulty_gyro_is_also_explained_on_the_console(capsys):
    """The gyro reads nothing while the bike is brought upright."""
    panel = on_the_stand()
    take_stand(panel)
    panel.attitude = np.eye(3)
    panel.hold(1.0)
    panel.press(SHORT)
    assert panel.hold(3.6) == ("Tilt 12°, gyro", "says 0°: redo")
    assert "by the gyro 0.0: align again" in capsys.readouterr().out


SIDES = ["+z", "+x", "-z", "-x", "+y", "-y"]
TURNS = [None, (-90, (0, 1, 0)), (-90, (0, 1, 0)), (-90, (0, 1, 0)), (90, (0, 0, 1)), (180, (1, 0, 0))]


def six(panel, quick=()):
    """Take the six sides from +z on. quick: numbers of the poses before which the sensor is turned too fast."""
    lines = [panel.choose("Six positions")]
    for k, turn in enumerate(TURNS):
        if turn:
            panel.turn(*turn, seconds=0.15 if k in quick else 1.0)
            panel.hold(0.1)
            panel.lines(panel.now_ms + 1500)
        panel.hold(0.4)
        panel.hold(0.3)
        lines.append(panel.lines())
        lines.append(panel.hold(2.0))
        panel.lines(panel.now_ms + 1500)
        lines.append(panel.lines())
    return lines


def test_six_positions_are_taken_in_any_order_and_checked():
    """The rates at rest are 1, -2 and 0.5 deg/s, which is the gyro's bias."""
    panel = Panel(aligned=False)
    panel.bias_dps = np.array([1.0, -2.0, 0.5])
    lines = six(panel)
    assert lines[0] == ("Side up, still:", "any of the six")
    for k, side in enumerate(SIDES):
        holding, confirmed, following = lines[1 + 3 * k : 4 + 3 * k]
        assert holding[0] == f"Side {side}, hold" and confirmed == (f"Side {side} done", f"{k + 1}/6, turn it")
        missing = [other for other in ("+x", "-x", "+y", "-y", "+z", "-z") if other not in SIDES[: k + 1]]
        assert following == ("Side up, still:", " ".join(missing)) if missing else following[0] == "Check: slant it"
    panel.turn(15.0, (1, 2, 3))
    panel.hold(0.7)
    assert panel.lines() == ("Slant it more:", "12° is too flat")
    panel.lines(panel.now_ms + 1500)
    panel.turn(25.0, (1, 2, 3))
    panel.hold(0.7)
    assert panel.lines()[0] == "Check, hold"
    assert panel.hold(2.0) == ("Computing...", "")
    assert panel.hold(1.0) == ("Saved, err 0 mg", "Now align it")
    assert panel.hold(6.0)[0].startswith("Raw")
    value = panel.app.calibration.value
    assert value.six_done and list(value.gyro_bias) == pytest.approx([1.0, -2.0, 0.5], abs=0.01)
