"""The page Try never shows a half-written display, sampled every 20 ms."""

import json
import re

import pytest
from support.mpy import run_mpy
from support.web.rider import LAPTOP, Rider

# This script simulates a ride as fast as possible, beginning with the first press. Each tick is 20 ms.
DRIVE = """
import json
from kickstand_tools.web.device import PageDevice

device, now, seen = PageDevice(), 0.0, []

def run(seconds):
    global now
    now += seconds
    device.run_to(now)
    for tick in json.loads(device.take()):
        if "display" in tick or "state" in tick:
            seen.append([tick["t_s"], tick.get("display", {}).get("text"), tick.get("state", {}).get("view")])

def press(seconds):
    device.order("button", True)
    run(seconds)
    device.order("button", False)
    run(0.4)

run(2)
press(0.15)
run(5)
device.order("pose", "upright")
run(4)
press(0.15)
run(5)
device.order("pose", 15.0)
run(20)
leans = 30, -25, 10, -40, 0, 5, 45, -3
for i in range(UNTIL_S // 5):
    device.order("lean", leans[i % len(leans)])
    run(5 if i % 4 else 4.45)
    if i % 4 == 0:
        press(0.15)
print("\\n" + json.dumps(seen))
"""
# Every complete first line that the display can show in this ride
WHOLE = re.compile(
    r" {16}$|Kickstand {7}$|Raw +-?\d+° [+-]\d\.\d\dg *$|Stand: hold {5}$|Now upright: {4}$|Upright: hold {3}$"
    r"|Aligned! +\d+\.\d° *$|Lean  -- {8}$|Lean +\d+° (left|right)? *$|Max left +\d+° *$|(Accel|Brake) +\d\.\d\d g *$"
    r"|Formula +-?\d+° *$| *-?\d\.\d\d *-?\d\.\d\d *-?\d\.\d\dg *$"
)
STARTED_S = 1.0
LASTING_S = 0.08  # the firmware writes a page every 0.1 s, so a text that disappears sooner was not a page
LOOK = """(seconds) => new Promise((done) => {
  const seen = [], until = performance.now() + 1000 * seconds;
  const look = () => {
    const words = [document.querySelector("#display").ariaLabel, document.querySelector("#shown-lean").textContent];
    seen.push([performance.now() / 1000, ...words, document.querySelector("#todo").textContent]);
    if (performance.now() < until) setTimeout(look, 20);
    else done(seen);
  };
  look();
})"""


def flashes(samples):
    """Return the texts that last for less than LASTING_S, without the first and the last text.

    samples: [[s, text], ...].
    """
    changes = [samples[0]]
    for sample in samples:
        if sample[1] != changes[-1][1]:
            changes.append(sample)
    return [
        (changes[i], round(changes[i + 1][0] - changes[i][0], 3))
        for i in range(1, len(changes) - 1)
        if changes[i + 1][0] - changes[i][0] < LASTING_S
    ]


@pytest.mark.parametrize("seconds", [60, pytest.param(300, marks=pytest.mark.nightly)])
def test_no_display_is_shown_half_written(seconds, tmp_path):
    lines = run_mpy(DRIVE.replace("UNTIL_S", str(seconds)), directory=tmp_path).splitlines()
    seen = [[t_s, text] for t_s, text, _ in json.loads(lines[-1]) if text]
    assert len(seen) > 3 * seconds
    assert [one for one in seen if not WHOLE.match(one[1][0])] == []
    pages = [
        [t_s, re.sub(r"[-+\d.°]+|left|right|Brake|Accel", "", text[0]).strip()] for t_s, text in seen if t_s > STARTED_S
    ]
    assert flashes(pages) == []


@pytest.mark.parametrize("seconds", [5, pytest.param(300, marks=pytest.mark.nightly)])
def test_the_page_flashes_nothing_in_a_ride(chromium, address, seconds):
    rider = Rider(chromium, address, **LAPTOP)
    rider.align()
    rider.guide_says("Ride!")
    rider.click("#do")
    rider.wait(13)
    rider.page.eval_on_selector("#lean", "lean => { lean.value = 25; lean.dispatchEvent(new Event('input')); }")
    rider.wait(3)
    samples = rider.page.evaluate(LOOK, seconds)
    assert len(samples) > 25 * seconds
    said = {(label, lean) for _, label, lean, _ in samples}
    assert all(re.match(r"Display: Lean \d+° right", label) for label, _ in said), said
    assert all(re.match(r"\d+° right$", lean) for _, lean in said), said
    assert not any("sure" in todo for *_, todo in samples)
    rider.context.close()
