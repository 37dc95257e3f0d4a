"""The steps, limits and times of both guided calibrations."""

from types import SimpleNamespace
from typing import Any

import pytest
from kickstand.errors import AlignmentError, CaptureError, GyroError, Notice
from kickstand_tools.simulated_board.simulator import Board

SHORT, LONG = 1, 2  # as in board/button.py


CHIP = SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=65.5, SATURATED=32700)


@pytest.fixture(autouse=True)
def _board():
    with Board(lambda t_s: (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0), display="ssd1306"):
        yield


# the alignment with two poses


def align_wizard(pressed=False) -> Any:
    from kickstand.ui.align_wizard import AlignWizard

    made: Any = AlignWizard(CHIP, 200, SimpleNamespace(value="old", save=lambda *_: None), "right", pressed)
    return made


def test_an_alignment_asks_and_takes_each_pose():
    made = align_wizard()
    assert made.lines(0) == ("On the stand,", "press button") and made.state == 0 and not made.upright
    made.press(SHORT, 0)
    assert made.lines(0) == ("Stand: hold", "") and made.state == 1
    made._pose_done(SimpleNamespace(gyro=[0.0] * 3), 0)
    assert made.lines(0) == ("Now upright:", "hold it, press") and made.state == 0 and made.upright
    made.press(SHORT, 0)
    assert made.lines(0) == ("Upright: hold", "") and made.state == 1
    assert align_wizard(True).lines(0) == ("Stand: hold", "")
    assert (made.POSE_SECONDS, made._taker._take_count, made._turn._period_us) == (3, 600, 5000)


def test_the_progress_of_a_pose_is_a_bar():
    made = align_wizard(True)
    made._taker = SimpleNamespace(restless=False)
    made._progress(300, 600)
    assert made.lines(0) == ("Stand: hold", "\xff" * 8)
    made._progress(0, 600)
    assert made.lines(0) == ("Stand: hold", "")
    made._taker.restless = True
    made._progress(0, 600)
    assert made.lines(0) == ("Stand: hold", "not still yet")


@pytest.mark.parametrize(
    ("tilt", "waited_ms", "fresh", "line1", "line2"),
    [
        (8.0, 89_999, True, "Aligned!   8.0\xdf", "Ride safely"),
        (7.94, 90_000, False, "Aligned!   7.9\xdf", "Little, 8\xdf best"),
        (12.3, 0, True, "Aligned!  12.3\xdf", "Ride safely"),
    ],
)
def test_the_result_of_an_alignment_is_shown_for_4_s(monkeypatch, tilt, waited_ms, fresh, line1, line2):
    from kickstand.ui import align_wizard as module

    seen = []
    monkeypatch.setattr(module, "align", lambda *given: seen.append(given) or ("new", tilt))
    monkeypatch.setattr(module, "check_turn", lambda *given: seen.append(given[:3]))
    made = align_wizard(True)
    made._calibration.save = lambda *given: seen.append(given)
    poses = SimpleNamespace(gyro=[0.0] * 3), SimpleNamespace(gyro=[1.0] * 3)
    made._pose_done(poses[0], 1000)
    assert made._turn.running
    made._pose_done(poses[1], 1000 + waited_ms)
    assert seen == [("old", *poses, "right"), ("old", *poses), ("new", fresh)]
    assert made.state == 4 and made.lines(4999 + waited_ms) == (line1, line2) and not made.ended
    assert made.lines(5000 + waited_ms) is None and made.ended


def test_presses_and_refusals_of_a_wizard(capsys):
    made = align_wizard(True)
    made._refuse(AlignmentError("tilt-small", 1.2, 3.0))
    assert made.lines(0) == ("Tilt only 1.2\xdf", "Need 3\xdf or more") and made.state == 3
    assert not made._turn.running and capsys.readouterr().out == ""
    made.press(SHORT, 0)
    assert made.state == 0 and made.lines(0) == ("On the stand,", "press button")
    made._refuse(GyroError("gyro-reversed", "x"))
    assert "wrong sign" in capsys.readouterr().out
    made.press(LONG, 0)
    assert made.ended and made.state == 5 and made.lines(0) is None
    made = align_wizard()
    made._show_for(9000, 4, 0, "a", "b")
    made.press(SHORT, 0)
    assert made.ended


def test_samples_are_taken_only_during_a_pose():
    made = align_wizard()
    seen: list = []
    made._taker = SimpleNamespace(
        step=lambda counts: seen.append(counts) or made.step, settled="settled", pose="pose", progress=lambda: (3, 9),
        restart=lambda: None, averaging=True,
    )  # fmt: skip
    made._settled = lambda *given: seen.append(("settled", *given))
    made._pose_done = lambda *given: seen.append(("done", *given))
    made._progress = lambda *given: seen.append(("progress", *given))
    made.sample([1], 5)
    assert not seen
    made.state = 1
    for made.step in (0, 1, 2, 3):
        made.sample([1], 5)
    steps = [call for call in seen if call != [1]]
    assert steps == [("progress", 3, 9), ("settled", "settled", 5), ("progress", 3, 9), ("done", "pose", 5)]
    made._turn = SimpleNamespace(add=lambda *given: seen.append(given))
    made.follow([0], 2, 10_000, 5)
    assert seen[-1] == ([0], 2, 10_000, True)
    made.state = 0
    made.follow([0], 2, 10_000, 5)
    assert seen[-1] == ([0], 2, 10_000, False)
    assert made.bears(None, 0) and not made.bears(Notice("clips", "Gyro"), 0)


# the six positions


def six(**given) -> Any:
    from kickstand.ui.six_wizard import SixWizard

    made: Any = SixWizard(CHIP, 200, SimpleNamespace(value=None, save=lambda *_: None))
    for name, value in given.items():
        setattr(made, name, value)
    return made


def test_six_positions_ask_for_the_missing_sides():
    made = six()
    assert made.lines(0) == ("Side up, still:", "any of the six")
    made._sides = [0, -1, 1, 2, -1, 3]
    made._next_pose()
    assert made.lines(0) == ("Side up, still:", "-x +z")
    made._fitted = ([0.0] * 3, [1.0] * 3)
    made._next_pose()
    assert made.lines(0) == ("Check: slant it", "and hold still")
    made._unproved = "y"
    made._next_pose()
    assert made.lines(0) == ("Slant it again,", "another way")
    assert made._taker._take_count == 400


def test_the_progress_of_a_side_is_named():
    made = six(_side=3)
    made._progress(0, 400)
    assert made.lines(0)[0] == "Side up, still:"
    made._progress(100, 400)
    assert made.lines(0) == ("Side -y, hold", "\xff" * 4)
    made._fitted = ([0.0] * 3, [1.0] * 3)
    made._progress(200, 400)
    assert made.lines(0) == ("Check, hold", "\xff" * 8)


@pytest.mark.parametrize(
    ("accel", "lines"),
    [
        ([0.0, 0.0, 1.0], None),
        ([0.0, 0.49, 0.87], None),
        ([0.0, 0.52, 0.855], ("Not on a side:", "31\xdf off")),
        ([1.0, 0.0, 0.0], ("Side +x is done", "1/6, turn it")),
    ],
)
def test_a_side_is_accepted_up_to_30_degrees_and_once(accel, lines):
    made = six(_sides=[0, -1, -1, -1, -1, -1])
    before = made.lines(0)
    made._settled(accel, 0)
    assert made.lines(1499) == (lines or before)
    assert made.lines(1500)[0] == "Side up, still:"
    if lines:
        assert made.state == 1


def test_the_slanted_pose_is_at_least_20_degrees_off():
    """The slope and the offset of the fit are used. The force along x is 0.8 * 0.4 + 0.02 = 0.34 g, which is a tilt of
    19.9 degrees."""
    for x, lines in ((0.4, ("Slant it more:", "19\xdf is too flat")), (0.41, ("Check: slant it", "and hold still"))):
        made = six(_fitted=([0.02, 0.0, 0.0], [0.8, 1.0, 1.0]))
        made._next_pose()
        made._settled([x, 0.0, 0.94], 0)
        assert made.lines(0) == lines


def test_a_spoilt_turn_may_be_repeated_up_to_12_poses():
    made = six(_poses=[0] * 10, _sides=[0, 1, 2, 3, 4, -1])
    assert not made._again()
    made._turn.running, made._turn.quick, made._turn.lost = True, False, True
    # 10 poses are taken, and three more are needed: the repeated pose, the missing side, the slanted pose
    assert not made._again()
    made._poses = [0] * 9
    assert made._again()
    made._turn.running = False
    assert not made._again()
    made._turn.running, made._turn.lost = True, False
    assert not made._again()


def test_a_turn_that_is_too_fast_is_said_once():
    made = six()
    made._turn.running, made._turn.quick, made._turn.lost = True, True, False
    made._followed(0)
    assert made.lines(0) == ("Turned too fast:", "turn it slower") and made.state == 2
    made._next_pose()
    made._followed(0)
    assert made.state == 1


@pytest.mark.parametrize(
    ("fault", "running", "bears"),
    [
        (Notice("clips", "Gyro"), True, True),
        (Notice("clips", "Gyro"), False, False),
        (Notice("clips", "Accel"), True, False),
        (Notice("sensor-lost"), True, False),
        (None, True, False),
    ],
)
def test_only_rates_at_the_end_of_the_range_are_borne(fault, running, bears):
    made = six()
    made._turn.start([0.0] * 3)
    made._turn.running = running
    assert made.bears(fault, 0) is bears
    assert made._turn.quick is bears


def test_the_result_of_six_positions(monkeypatch):
    from kickstand.ui import six_wizard

    monkeypatch.setattr(six_wizard, "six_position_calibration", lambda *given: given)
    saved = []
    fit = SimpleNamespace(offset="o", slope="s", unproved=(), matrices=lambda: "m")
    made = six(_fit=fit, _poses=[0] * 4, _bias=[4.0, 8.0, -4.0], _error=-0.0124)
    made._calibration.save = saved.append
    made._computed(0)
    assert saved == [("o", "s", [1.0, 2.0, -1.0], "m")] and made._fit is None
    assert made.lines(5999) == ("Saved, err 12 mg", "Now align it") and made.lines(6000) is None


def test_an_unproved_gyro_needs_another_pose_up_to_12():
    fit = SimpleNamespace(unproved=("z", "x"))
    made = six(_fit=fit, _poses=[0] * 11)
    made._computed(0)
    assert made._unproved == "z" and made.lines(0) == ("Slant it again,", "another way")
    with pytest.raises(GyroError):
        six(_fit=fit, _poses=[0] * 12)._computed(0)


def test_turns_between_poses_are_kept_unless_they_are_spoilt():
    made = six(_side=2)
    made._pose_done(SimpleNamespace(accel="a", gyro=[1.0, 2.0, 3.0]), 0)
    assert made._turns == [] and made._poses == ["a"] and made._sides == [-1, -1, 0, -1, -1, -1]
    assert made.lines(0) == ("Side +y done", "1/6, turn it") and made._turn.running
    made._turn.quick = True
    made._pose_done(SimpleNamespace(accel="b", gyro=[1.0, 2.0, 3.0]), 0)
    assert made._turns == [None] and made._sides[2] == 0  # the first pose of a side is kept
    made._pose_done(SimpleNamespace(accel="c", gyro=[1.0, 2.0, 3.0]), 0)
    assert len(made._turns) == 2 and made._turns[1][1] == made._turn.seconds
    assert made._bias == [3.0, 6.0, 9.0]


def test_a_spoilt_pose_of_six_is_a_notice():
    made = six()
    made._spoilt(CaptureError("moved"), 0)
    assert made.state == 2 and made.lines(1499) == ("Moved!", "Hold it still")
