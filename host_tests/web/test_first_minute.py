"""A first visit in Chromium, with real clicks and keys: from an empty page to the lean, then what can be broken."""

import json
import subprocess
import sys

import pytest
import repeat
from kickstand_tools import unix_port
from rider import Rider

LEAN_DEG = 30
RIDING_S = 6
SLOWED = 4  # times


@pytest.mark.long
@pytest.mark.parametrize("cut", [False, pytest.param(True, marks=pytest.mark.nightly)], ids=["", "power cut"])
def test_a_first_visit(chromium, address, tmp_path, cut):
    """In real time, so all in one. What the guide says of a power cut, test_guide.py shows each time."""
    rider = Rider(chromium, address, viewport={"width": 1440, "height": 900})
    first_minute(rider)
    pull_the_wire(rider)
    if cut:
        cut_the_power_in_a_save(rider)
    is_what_the_firmware_shows(rider, tmp_path)
    assert rider.seen("shifts") == [], "the layout moved"
    works_without_a_network(rider, address)
    assert rider.errors == []
    assert [url for url in rider.asked if not url.startswith(address)] == []
    rider.context.close()


def first_minute(rider):
    """From nothing to a lean within two degrees of the true one, to both sides."""
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
    # Chromium does not slow workers down. What theirs uses says the same, on however busy a machine.
    assert 0.0 < used_s < RIDING_S / SLOWED


def pull_the_wire(rider):
    rider.click("#wire")
    rider.guide_says("wire is out")
    rider.reads("No sensor")
    assert rider.text("#shown-lean") == "a fault"
    rider.click("#do")  # plug it in
    rider.reads("Lean")
    rider.wait(1)


def cut_the_power_in_a_save(rider):
    """Of the alignment: the one before is still there."""
    for armed in "true", "false", "true":
        rider.click("#cut")
        rider.page.wait_for_selector(f"#cut[aria-pressed={armed}]")
    rider.guide_says("next save")
    rider.click("#do")  # put it on its stand
    rider.guide_says("Hold the button for a second")
    rider.wait(7)  # until it stands there
    rider.hold(1.2)
    rider.guide_says("Hold the button once more")
    rider.hold(1.2)
    rider.reads("On the stand")
    rider.align()
    rider.guide_says("when 40 bytes")
    rider.reads("blank")
    rider.click("#do")  # switch it on
    rider.reads("Lean")
    rider.guide_says("The old alignment is still there")
    rider.click("#press")
    rider.reads("Max left")


def is_what_the_firmware_shows(rider, flash):
    """The display's memories, frame by frame, with the same orders at the same instants to kickstand.start.main() on
    MicroPython for Linux, or on CPython."""
    displays, orders = rider.seen("displays"), rider.seen("orders")
    on_unix = unix_port.available()
    script = [repeat.__file__, "loop"]
    done = subprocess.run(
        unix_port.command("-X", "heapsize=64M", *script) if on_unix else [sys.executable, *script],
        input=json.dumps({"orders": orders, "until_s": displays[-1][0] + 0.001}),
        capture_output=True,
        text=True,
        env=unix_port.environment() if on_unix else None,
        cwd=flash,
        check=True,
    )
    assert len(displays) > 100
    assert json.loads(done.stdout.splitlines()[-1])["displays"] == displays


def works_without_a_network(rider, address):
    rider.page.wait_for_function("navigator.serviceWorker.controller")
    assert "works without a network" in rider.text("#offline")
    rider.context.set_offline(True)
    for name in "", "index.html":
        rider.page.goto(address + name)
        rider.reads("Raw")
