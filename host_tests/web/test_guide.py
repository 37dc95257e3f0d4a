"""Tests the guide's next step for each state of the real firmware. The page's device runs at full speed, and gets the
orders of a rider. The page's own guide then gets each state that the rider could see."""

import json
from pathlib import Path

import pytest
from kickstand.ui import messages
from support.mpy import run_mpy

# Carries out orders (s, name, value): waits s seconds, then acts. Most names are explained in Device.act(). The name
# turn_to presses the button until a view is shown.
DRIVE = """
import json, sys
from kickstand_tools.web.device import PageDevice
from support.page_turner import PageTurner

device, now, said = PageDevice(), 0.0, []
state = {"powered": True, "plugged": True, "armed": False, "pose": "kickstand", "stage": -1}

def run(seconds):
    global now
    now += seconds
    device.run_to(now)
    for tick in json.loads(device.take()):
        cut = state["armed"] and not tick["powered"]
        state["armed"] = state["armed"] and tick["powered"]
        seen = dict(state)
        seen.update(tick)
        seen["cut"] = cut
        said.append(seen)

def press(seconds):
    device.order("button", True)
    run(seconds)
    device.order("button", False)
    run(0.4)

def do(name, value):
    if name == "turn_to":
        turner = PageTurner()
        turner.turn_to(value)
        while turner.presses(device.state()["view"]):
            press(0.15)
        return turner.check()
    if name in ("press", "wait"):
        return press(value) if name == "press" else run(value)
    device.order(name, value)
    if name == "pose":
        state["pose"] = value if isinstance(value, str) else "ride"
    elif name not in ("lean", "button"):
        state[{"sensor": "plugged", "power": "powered", "cut_save": "armed"}[name]] = value

for stage, orders in enumerate(json.load(sys.stdin)):
    state["stage"] = stage
    for order in orders:
        do(*order)
print("\\n" + json.dumps(said))
"""

# This script does the same as tell() in main.mjs.
LOOK = Path(__file__).with_name("guide_steps.js").read_text()

SHORT, LONG = ("press", 0.15), ("press", 1.2)
STAND, UPRIGHT, RIDE = ("pose", "kickstand"), ("pose", "upright"), ("pose", 15.0)
PULL, PLUG = ("sensor", False), ("sensor", True)
ALIGN = [("wait", 1.5), SHORT, ("wait", 4), UPRIGHT, ("wait", 3), SHORT, ("wait", 4)]
RIDING = [*ALIGN, RIDE, ("wait", 12), ("lean", 30), ("wait", 6)]


@pytest.fixture(scope="module")
def guide(chromium, address):
    """Return a function that runs the page's modules without its board: the result of LOOK for a list of ticks."""
    page = chromium.new_page()
    page.goto(address + "licences.txt")
    yield lambda ticks: page.evaluate(LOOK, ticks)
    page.close()


@pytest.fixture
def drive(guide, tmp_path):
    """Return a function that runs orders and returns the guide's last texts in each stage.

    The result is {stage: [words beside the true lean, number of the step, text, action]}.
    """

    def drive(orders):
        done = run_mpy(DRIVE, stdin=json.dumps(orders), directory=tmp_path)
        return {stage: said for stage, *said in guide(json.loads(done.splitlines()[-1]))}

    return drive


@pytest.fixture
def stages(drive):
    """Return a function that checks the guide at the end of each stage of a drive.

    Each stage is (orders, words beside the true lean, number of the step, a part of its text, action).
    """

    def check(*table):
        last = drive([orders for orders, *_ in table])
        for stage, (_, words, number, text, action) in enumerate(table):
            said_words, said_number, said_text, said_action = last[stage]
            assert text in said_text, (stage, said_text)
            assert (said_words, said_number, said_action) == (words, number, action), (stage, said_text)

    return check


def test_a_press_while_riding_is_taken_for_the_stand(stages):
    stages(
        ([RIDE, ("wait", 8)], "not aligned", 1, "Put the motorcycle on its stand first", "kickstand"),
        ([SHORT, ("wait", 3)], "aligning", 1, "that the motorcycle is on its stand", "kickstand"),
        ([("wait", 9)], "refused", 1, "why this pose was refused", "kickstand"),
        ([STAND, ("wait", 9)], "refused", 1, "Press the button to try again", ""),
        ([SHORT, ("wait", 4.5)], "aligning", 2, "Now hold the motorcycle upright", "upright"),
        ([UPRIGHT, ("wait", 4)], "aligning", 2, "Press the button once more", ""),
    )


def test_the_same_pose_twice(stages):
    stages(
        ([("wait", 2), SHORT, ("wait", 4.5)], "aligning", 2, "Now hold the motorcycle upright", "upright"),
        ([SHORT, ("wait", 1)], "aligning", 2, "that the motorcycle is upright", "upright"),
        ([("wait", 3.5)], "refused", 1, "Both poses were the same", ""),
        ([SHORT], "aligning", 1, "Press the button", ""),
        ([UPRIGHT, ("wait", 4)], "aligning", 1, "on its stand first", "kickstand"),
        ([SHORT, ("wait", 0.5)], "aligning", 1, "that the motorcycle is on its stand", "kickstand"),
    )


def test_the_wire_is_pulled_while_the_menu_is_open(stages):
    stages(
        (RIDING, "not sure", 5, "That is all", ""),
        ([LONG], "the menu", 0, "The menu", ""),
        ([PULL, ("wait", 2)], "the menu", 0, "The menu hides the message", "wire"),
        ([SHORT, ("wait", 21)], "a fault", 0, "shows no lean", "wire"),
        ([PLUG, ("wait", 0.1)], "a fault", 0, "The firmware sets it up", ""),
        ([("wait", 6)], "not sure", 5, "That is all", ""),
        ([STAND, ("wait", 9), LONG, LONG, SHORT, PULL, ("wait", 1)], "a fault", 0, "stops the alignment", "wire"),
        ([("wait", 3)], "a fault", 0, "shows no lean", "wire"),
    )


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


def test_the_power_goes_in_a_save_or_by_its_switch(stages):
    arm, on = ("cut_save", True), ("power", True)
    stages(
        ([*RIDING, arm, ("wait", 0.1)], "not sure", 0, "Stop for a new alignment", "kickstand"),
        ([("cut_save", False), ("wait", 0.1)], "not sure", 5, "That is all", ""),
        ([arm, STAND, ("wait", 9)], "not sure", 0, "Hold the button for a second", ""),
        ([LONG, SHORT], "the menu", 0, "Press until the menu says", ""),
        ([*[SHORT] * 5], "the menu", 0, "Hold the button once more", ""),
        ([LONG, *ALIGN], "nothing", 0, "after 40 bytes", "power"),
        ([on, ("wait", 0.1)], "starting", 0, "The board starts", ""),
        ([("wait", 4)], "not sure", 5, "The old alignment is still there", "ride"),
        ([RIDE, ("wait", 6)], "not sure", 5, "", ""),
        ([("power", False), ("wait", 0.2)], "nothing", 0, "The board has no power", "power"),
        ([("button", True), on, ("wait", 2), ("button", False), ("wait", 0.2)], "safe mode", 0, "Safe mode", "power"),
    )


def test_it_rides_straight_until_the_meter_is_sure(stages):
    """If the rider leans too early, the guide asks for a straight and says how long it must be. After that time, the
    display keeps showing the lean in a bend."""
    stages(
        ([*ALIGN, RIDE, ("wait", 5)], "not sure", 4, "It rides straight for ten seconds", ""),
        ([("lean", 30), ("wait", 2)], "not sure", 4, "needs ten seconds on a straight", "straight"),
        ([("lean", 0), ("wait", 18)], "not sure", 4, "Lean it", ""),
        ([("lean", 40), ("wait", 4)], "not sure", 5, "That is all", ""),
    )


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


def test_it_rides_straight_is_not_said_of_a_bike_that_leans(guide):
    """Before and after the first lean the guide asks for ten seconds on a straight."""
    tick = {"powered": True, "plugged": True, "pose": "ride", "phase": "ride", "stage": 0}
    tick.update(t_s=1.0, lean_deg=-7.5)
    said = [
        guide([{**tick, "display": {"shown_deg": shown}, "state": {"view": "lean", "trusted": shown is not None}}])[0][
            3
        ]
        for shown in (None, 30)
    ]
    assert all("needs ten seconds on a straight" in one for one in said)


def test_a_disarmed_save_is_whole(drive):
    said = drive([[("cut_save", True), ("wait", 1), ("cut_save", False), *ALIGN]])
    assert said[0][2].startswith("Done")


# In messages.py each kind of refusal or fault is one paragraph of lines. The list has the codes of each paragraph.
_PARAGRAPHS = [[line.split("|")[0] for line in part.split("\n")] for part in messages._LINES.strip().split("\n\n")]
SPOILT, _, UNLIKE, FLASH, _, FAULTS = _PARAGRAPHS[:6]


def view_of(code):
    """Return the state in which the firmware shows this code. The states are in kickstand/state.py."""
    if code in FAULTS:
        return {"view": "fault", "code": code, "fault": code}
    if code in SPOILT:
        return {"view": "align", "step": "ask", "pose": "kickstand", "code": code}
    return {"view": "align", "step": "refused", "pose": "upright", "code": code}


def test_each_refusal_and_fault_has_its_step(guide):
    """The test includes codes that the simulated board never reaches."""
    tick = {"powered": True, "plugged": True, "pose": "kickstand", "phase": "kickstand", "t_s": 1.0, "stage": 0}
    spoilt = ("refused", "The display says why this pose was refused. Press the button to try again.")
    unlike = ("refused", "The display says why both poses were refused. Press the button to begin again.")
    again = ("a fault", "The sensor answers again. The firmware sets it up.")
    wanted: dict[str, tuple[str, str]] = dict.fromkeys(FAULTS, again)
    wanted["starting"] = ("starting", "The board starts.")
    wanted |= dict.fromkeys(SPOILT, spoilt) | dict.fromkeys([*UNLIKE, *FLASH], unlike)
    wanted["same-pose"] = ("refused", "Both poses were the same. Press the button, and begin again with the stand.")
    said = {code: guide([{**tick, "state": view_of(code)}])[0] for code in wanted}
    assert len(said) >= 35
    assert {code: (words, text) for code, (_, words, _, text, _) in said.items()} == wanted


@pytest.mark.parametrize(
    ("view", "words", "text"),
    [
        ({"view": "starting"}, "starting", "board starts"),
        ({"view": "notice", "code": "sensor-lost", "fault": "sensor-lost"}, "a fault", "answers again"),
        ({"view": "notice", "code": "stopped"}, "a fault", "stopped the alignment"),
    ],
)
def test_a_start_and_a_notice_have_their_step(guide, view, words, text):
    tick = {"powered": True, "plugged": True, "pose": "kickstand", "phase": "kickstand", "t_s": 1.0, "stage": 0}
    ((_, said_words, _, said, _),) = guide([{**tick, "state": view}])
    assert said_words == words and text in said


def test_a_lean_that_is_not_sure_is_no_other_page(guide):
    tick = {"powered": True, "plugged": True, "pose": "ride", "phase": "straight", "t_s": 1.0, "stage": 0}
    for view in "lean", "raw":
        ((_, words, number, said, _),) = guide([{**tick, "state": {"view": view, "trusted": False}}])
        assert (words, number) == ("not sure", 4) and "not sure yet" in said
