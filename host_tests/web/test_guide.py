"""The guide of the page Try: its next step for each state of the real firmware, and for states of which it only reads.

The page's device runs at full speed and gets the orders of a rider. The page's own guide, in node, then gets each state
that the rider could see.
"""

from pathlib import Path

import pytest
from page_drive import ALIGN, LONG, RIDE, RIDING, SHORT, STAND, UPRIGHT, Drive

# This script does the same as tell() in main.mjs. It returns [stage, words beside the true lean, number of the step,
# text, action] after each tick.
STEPS = Path(__file__).with_name("guide_steps.js").read_text()


@pytest.fixture
def stages(node, tmp_path, monkeypatch):
    """Return a function that checks the guide at the end of each stage of a drive.

    Each stage is (orders, words beside the true lean, number of the step, a part of its text, action).
    """
    monkeypatch.chdir(tmp_path)  # the board's flash
    with Drive() as drive:

        def check(*table):
            for drive.state["stage"], (orders, *_) in enumerate(table):
                for order in orders:
                    drive.do(*order)
            last = {stage: step for stage, *step in node(STEPS, drive.records)}
            for stage, (_, words, number, text, action) in enumerate(table):
                shown_words, shown_number, shown_text, shown_action = last[stage]
                assert text in shown_text, stage
                assert (shown_words, shown_number, shown_action) == (words, number, action), (stage, shown_text)

        yield check


def test_a_press_while_riding_is_taken_for_the_stand(stages):
    stages(
        ([RIDE, ("wait", 8)], "not aligned", 1, "Put the motorcycle on its stand first", "kickstand"),
        ([SHORT, ("wait", 3)], "aligning", 1, "that the motorcycle is on its stand", "kickstand"),
        ([("wait", 9)], "refused", 1, "why this pose was refused", "kickstand"),
        ([STAND, ("wait", 9)], "refused", 1, "Press the button to try again", ""),
        ([SHORT, ("wait", 4.5)], "aligning", 2, "Now hold the motorcycle upright", "upright"),
        ([UPRIGHT, ("wait", 4)], "aligning", 2, "Press the button once more", ""),
    )


@pytest.mark.long
def test_each_page_is_named(stages):
    stages(
        (RIDING, "not sure", 5, "That is all", ""),
        ([("turn_to", "maxima")], "maxima", 5, "the largest lean", ""),
        ([("turn_to", "acceleration")], "g", 5, "acceleration and braking", ""),
        ([("turn_to", "formula")], "formula", 5, "formula", ""),
        ([("turn_to", "raw")], "readings", 5, "the sensor itself", ""),
        ([("turn_to", "lean")], "not sure", 5, "That is all", ""),
        ([LONG, *[SHORT] * 3], "the menu", 0, "The menu", ""),
        ([LONG], "sensor info", 0, "the sensor, and what is calibrated", ""),
        ([SHORT], "not sure", 5, "That is all", ""),
        ([LONG, SHORT, LONG], "positions", 0, "turn the sensor by hand", ""),
    )


@pytest.mark.long
def test_it_rides_straight_until_the_meter_is_sure(stages):
    """If the rider leans too early, the guide asks for a straight and says how long it must be. After that time, the
    display keeps showing the lean in a bend."""
    stages(
        ([*ALIGN, RIDE, ("wait", 5)], "not sure", 4, "It rides straight for ten seconds", ""),
        ([("lean", 30), ("wait", 2)], "not sure", 4, "needs ten seconds on a straight", "straight"),
        ([("lean", 0), ("wait", 18)], "not sure", 4, "Lean it", ""),
        ([("lean", 40), ("wait", 4)], "not sure", 5, "That is all", ""),
    )


@pytest.mark.long
def test_after_power_on_in_a_bend_it_says_what_ends_the_doubt(stages):
    """Riding on in the bend does not help. In a steady bend the firmware cannot tell the lean from an error of the
    sensor."""
    power = [("power", False), ("wait", 0.5), ("power", True)]
    stages(
        ([*RIDING, ("lean", -8), ("wait", 4)], "not sure", 5, "That is all", ""),
        ([*power, ("wait", 25)], "not sure", 4, "ride straight, or lean the other way", "straight"),
        ([("lean", 0), ("wait", 12)], "not sure", 5, "That is all", ""),
        ([("lean", -8), ("wait", 4), *power, ("wait", 20)], "not sure", 4, "In a steady bend", "straight"),
        ([("lean", 20), ("wait", 12)], "not sure", 5, "That is all", ""),
    )


AGAIN = "Press the button to try again."
BEGIN = "Press the button to begin again."


@pytest.mark.parametrize(
    ("state", "words", "number", "text"),
    [
        ({"view": "starting"}, "starting", 0, "The board starts."),
        ({"view": "fault", "code": "starting", "fault": "starting"}, "starting", 0, "The board starts."),
        ({"view": "fault", "code": "sensor-lost", "fault": "sensor-lost"}, "a fault", 0, "The sensor answers again."),
        ({"view": "notice", "code": "sensor-lost", "fault": "sensor-lost"}, "a fault", 0, "The sensor answers again."),
        ({"view": "notice", "code": "stopped"}, "a fault", 0, "has stopped the alignment."),
        ({"view": "align", "step": "ask", "pose": "kickstand", "code": "moved"}, "refused", 1, AGAIN),
        ({"view": "align", "step": "ask", "pose": "kickstand", "code": "dead-gyro"}, "refused", 1, AGAIN),
        ({"view": "align", "step": "refused", "pose": "upright", "code": "tilt-large"}, "refused", 1, BEGIN),
        ({"view": "align", "step": "refused", "pose": "upright", "code": "not-written"}, "refused", 1, BEGIN),
        ({"view": "align", "step": "refused", "pose": "upright", "code": "same-pose"}, "refused", 1, "were the same."),
    ],
)
def test_each_refusal_and_fault_has_its_step(node, state, words, number, text):
    """The display says why, in the words of ui/messages.py."""
    tick = {"powered": True, "plugged": True, "pose": "kickstand", "phase": "kickstand", "t_s": 1.0, "stage": 0}
    ((_, shown_words, shown_number, step_shown, _),) = node(STEPS, [{**tick, "state": state}])
    assert (shown_words, shown_number) == (words, number) and text in step_shown


def test_a_disarmed_save_is_whole(stages):
    save = ("cut_save", True), ("wait", 1), ("cut_save", False)
    stages(([*save, *ALIGN], "aligned", 3, "Done: the meter knows the angle", "ride"))
