"""The page Try in Chromium. The main job is to align the simulated meter, to ride, and to compare the lean.

The board's clock is eight times as fast as usual, if the test does not need the usual clock.
"""

import json
import re
import time
from pathlib import Path

import pytest
from support.mpy import run_mpy
from support.web import page_repeated
from support.web.rider import LAPTOP, Rider

WINDOW = {"width": 1000, "height": 700}
LEAN_DEG = 30
LOOK, FOREIGN = (Path(__file__).with_name(f"{name}.js").read_text() for name in ("look", "foreign"))


@pytest.fixture
def visit(chromium, address, faster_address):
    """Return a function that opens the page. At the end, the page had no error and asked no other server."""
    riders = []

    def visit(name="", faster=False, **kind):
        riders.append(Rider(chromium, (faster_address if faster else address) + name, **kind))
        return riders[-1]

    yield visit
    for rider in riders:
        assert rider.errors == [] and rider.strangers() == []
        rider.context.close()


def ride_off(rider):
    """Align the meter, and ride straight until the guide asks for a lean."""
    rider.align()
    rider.guide_says("Ride!")
    rider.click("#do")
    rider.guide_says("Lean it")


def test_two_presses_a_ride_and_a_bend_show_the_lean(visit):
    rider = visit(viewport=WINDOW, faster=True)
    ride_off(rider)
    rider.keys("ArrowRight", LEAN_DEG // 5)
    rider.guide_says("That is all")
    true_deg, shown_deg = rider.leans()
    assert true_deg > LEAN_DEG - 4 and shown_deg == pytest.approx(true_deg, abs=2.0)
    assert rider.moved() == []


def loop_s():
    """Return the processor time of a loop of a million sums on this computer, in s. It is the median of five runs."""
    times_s = []
    for _ in range(5):
        begin_s, total = time.process_time(), 0
        for i in range(1_000_000):
            total += i * i
        times_s.append(time.process_time() - begin_s)
    return sorted(times_s)[2]


@pytest.mark.long
def test_faults_are_shown_as_the_firmware_does_and_without_a_network(visit, address, tmp_path):
    """At the usual speed. The firmware's own loop, with the same orders at the same times, fills the display's memory
    in the same way. The board needs less than a slow phone's processor has."""
    rider = visit(viewport=WINDOW)
    rider.align()
    rider.reads("Aligned!")
    rider.click("#do")
    rider.slow(4)
    used_s = rider.worker_s()
    rider.wait(3)
    used_s = rider.worker_s() - used_s
    rider.slow(1)
    # The processor time on the reference computer, where loop_s() is 0.06. A slow phone is four times as slow.
    assert 0.0 < used_s * 0.06 / loop_s() < 3 / 4
    rider.click("#wire")
    rider.guide_says("wire is out")
    rider.reads("No sensor")
    rider.page.wait_for_selector("#shown-lean:has-text('a fault')")
    rider.click("#do")  # the guide's button: plug the board in
    rider.reads("Lean")
    for armed in "true", "false":
        rider.click("#cut")
        rider.page.wait_for_selector(f"#cut[aria-pressed={armed}]")
    displays, orders = rider.seen("displays"), rider.seen("orders")
    plan = json.dumps({"orders": orders, "until_s": displays[-1][0] + 0.001})
    printed = run_mpy(Path(page_repeated.__file__), "loop", stdin=plan, directory=tmp_path)
    assert len(displays) > 40 and json.loads(printed.splitlines()[-1])["displays"] == displays
    rider.page.wait_for_function("navigator.serviceWorker.controller")
    assert "works without a network" in rider.text("#offline")
    rider.context.set_offline(True)
    for name in "", "index.html":
        rider.page.goto(address + name)
        rider.reads("Raw")


@pytest.mark.long
def test_the_page_flashes_nothing_in_a_bend(visit):
    rider = visit(faster=True, **LAPTOP)
    ride_off(rider)
    rider.keys("ArrowRight", 5)
    rider.wait(3)
    samples = rider.page.evaluate(LOOK, 3)
    assert len(samples) > 60
    for label, lean, todo in samples:
        assert re.match(r"Display: Lean \d+° right", label) and re.match(r"\d+° right$", lean) and "sure" not in todo


ACTIVE = "document.activeElement.id || document.activeElement.value"


@pytest.mark.long
def test_by_the_keyboard_alone(visit):
    """The arrow keys change the lean, and the space bar is the board's button. Controls that the rider cannot move
    show what the motorcycle does. The focus stays when the guide shows its next step."""
    rider = visit(faster=True, **LAPTOP)
    page = rider.page

    def tab_to(name):
        for _ in range(20):
            page.keyboard.press("Tab")
            if page.evaluate(ACTIVE) == name:
                return
        raise AssertionError(f"no Tab leads to {name}")

    def says(selector, text):
        page.wait_for_function("([one, text]) => document.querySelector(one).value === text", arg=[selector, text])

    rider.reads("Raw")
    says("#lean-out", "12° left")
    assert page.is_disabled("#speed") and page.input_value("#speed") == "0"
    tab_to("ride")
    rider.keys("Space", 1)
    says("#speed-out", "54 km/h")
    rider.keys("ArrowUp", 1)
    rider.keys("ArrowRight", 2)
    says("#speed-out", "64 km/h")
    says("#lean-out", "10° right")
    assert page.get_attribute("#pose [value=ride]", "aria-pressed") == "true"
    assert page.get_attribute("#speed", "min") == "20"
    rider.guide_says("Put the motorcycle on its stand first")
    page.focus("#do")
    rider.keys("Enter", 1)
    says("#speed-out", "0 km/h")
    assert page.evaluate(ACTIVE) == "press" and page.is_disabled("#speed")
    rider.guide_says("Press the button.")
    rider.keys("Space", 1)
    rider.reads("Stand: hold")
    assert rider.moved() == []


@pytest.mark.long
def test_a_foreign_script_does_not_run(visit):
    """The page itself works under its policy. Most other tests switch the policy off."""
    rider = visit(policy=True, **LAPTOP)
    rider.page.locator('#display[aria-label^="Display: "]').wait_for()
    assert rider.errors == []
    rider.page.evaluate(FOREIGN)
    assert rider.page.evaluate("() => window.ours") is None
    assert "Content Security Policy" in rider.errors.pop()


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("python.json", "./python.json cannot be loaded (HTTP 404)"),
        ("micropython/micropython.wasm", "./micropython/micropython.wasm cannot be loaded (HTTP 404)"),
        ("bike.mjs", "file of this page cannot be loaded"),
    ],
)
def test_a_missing_file_is_told_in_one_line(chromium, address, name, words):
    context = chromium.new_context()
    context.route(f"**/{name}", lambda route: route.fulfill(status=404, body="not here"))
    page = context.new_page()
    page.goto(address)
    page.wait_for_function("text => document.querySelector('#todo').textContent.includes(text)", arg=words)
    assert page.inner_text("#todo").endswith("Load the page again.")
    context.close()
