"""A first visit in Chromium, with real clicks and keys: from an empty page to the lean, then faults and repairs."""

import json
import time
from pathlib import Path

import pytest
from support.mpy import run_mpy
from support.web import page_repeated
from support.web.rider import Rider

LEAN_DEG = 30
RIDING_S = 6
SLOWED = 4  # a slow phone is slower than the reference computer by this factor
# result of _loop_s() on the reference computer, for which the limit of the processor time is set
REFERENCE_LOOP_S = 0.06


@pytest.mark.long
def test_a_first_visit(chromium, address, tmp_path):
    """One test has all steps, because they run in real time. test_guide.py tests the steps after a power cut."""
    rider = Rider(chromium, address, viewport={"width": 1000, "height": 700})
    first_minute(rider)
    pull_the_wire(rider)
    for armed in "true", "false":
        rider.click("#cut")
        rider.page.wait_for_selector(f"#cut[aria-pressed={armed}]")
    is_what_the_firmware_shows(rider, tmp_path)
    assert rider.moved() == []
    works_without_a_network(rider, address)
    assert rider.errors == []
    assert [url for url in rider.asked if not url.startswith(address)] == []
    rider.context.close()


def first_minute(rider):
    """Start with an empty page. At the end the shown lean is within two degrees of the true lean, in leans to the left
    and to the right."""
    rider.align()
    rider.reads("Aligned!")
    rider.click("#do")  # ride
    rider.guide_says("Lean it")
    rider.slow(SLOWED)
    rider.keys("ArrowRight", LEAN_DEG // 5)
    rider.guide_says("That is all")
    true_deg, shown_deg = rider.leans()
    assert true_deg > LEAN_DEG - 4
    assert shown_deg == pytest.approx(true_deg, abs=2.0)
    rider.page.focus("#lean")
    rider.keys("ArrowLeft", 2 * LEAN_DEG)
    used_s = rider.worker_s()
    rider.wait(RIDING_S)
    used_s = rider.worker_s() - used_s
    rider.slow(1)
    true_deg, shown_deg = rider.leans()
    assert true_deg < 4 - LEAN_DEG
    assert shown_deg == pytest.approx(true_deg, abs=2.0)
    # Chromium cannot slow down workers. Instead, convert the workers' processor time to the time of the reference
    # computer. The converted time must leave room for a processor that is SLOWED times slower.
    assert 0.0 < used_s * REFERENCE_LOOP_S / _loop_s() < RIDING_S / SLOWED


def _loop_s():
    """Return the processor time of a loop of a million sums on this computer, in s. The result is the median of five
    runs."""
    times_s = []
    for _ in range(5):
        begin_s = time.process_time()
        total = 0
        for i in range(1_000_000):
            total += i * i
        times_s.append(time.process_time() - begin_s)
    return sorted(times_s)[2]


def pull_the_wire(rider):
    rider.click("#wire")
    rider.guide_says("wire is out")
    rider.reads("No sensor")
    rider.page.wait_for_selector("#shown-lean:has-text('a fault')")
    rider.click("#do")  # the guide's button: plug the board in
    rider.reads("Lean")
    rider.wait(1)


def is_what_the_firmware_shows(rider, flash):
    """Repeat the orders at the same times with kickstand.start.main() on MicroPython for Linux. The display's memory
    must be the same in each frame."""
    displays, orders = rider.seen("displays"), rider.seen("orders")
    assert len(displays) > 60  # the worker sends a display that changes all the time at most ten times per second
    given = json.dumps({"orders": orders, "until_s": displays[-1][0] + 0.001})
    said = run_mpy(Path(page_repeated.__file__), "loop", stdin=given, directory=flash)
    assert json.loads(said.splitlines()[-1])["displays"] == displays


def works_without_a_network(rider, address):
    rider.page.wait_for_function("navigator.serviceWorker.controller")
    assert "works without a network" in rider.text("#offline")
    rider.context.set_offline(True)
    for name in "", "index.html":
        rider.page.goto(address + name)
        rider.reads("Raw")
