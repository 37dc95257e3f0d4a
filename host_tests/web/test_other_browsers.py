"""The page Try in WebKit, as on an iPhone, and in Firefox: the main job, with eight times the board's speed."""

import time

import pytest
from support.web.webdriver import Firefox, Missing, WebKit

pytestmark = pytest.mark.long
PACKAGES = {WebKit: "webkit2gtk-driver and xvfb", Firefox: "firefox-esr"}  # of Debian
PATIENCE_S = 60.0
LOOK = """const text = (id) => document.querySelector(id).textContent;
return [text("#todo"), text("#shown-lean"), text("#true-lean")];"""
LEAN = """const lean = document.querySelector("#lean");
lean.value = 30;
lean.dispatchEvent(new Event("input"));"""


@pytest.fixture(params=[WebKit, Firefox], ids=["WebKit", "Firefox"])
def browser(request):
    try:
        browser = request.param()
    except Missing:
        pytest.skip(f"no {request.param.__name__}: on Debian {PACKAGES[request.param]}")
    yield browser
    browser.end()


def test_two_presses_a_ride_and_a_bend_show_the_lean(browser, faster_address):
    browser.visit(faster_address)

    def wait_for(words):
        begin_s = time.monotonic()
        while words not in (texts := browser.run(LOOK))[0]:
            assert time.monotonic() - begin_s < PATIENCE_S, texts
            time.sleep(0.1)
        return texts

    wait_for("Press the button")
    browser.click("#press")
    wait_for("Now hold the motorcycle upright")
    browser.click("#do")
    wait_for("Press the button once more")
    browser.click("#press")
    wait_for("Ride!")
    browser.click("#do")
    wait_for("Lean it")
    browser.run(LEAN)
    _, displayed, true = wait_for("That is all")
    assert displayed.endswith("° right") and true.endswith("° right")
    shown_deg, true_deg = (float(text.partition("°")[0]) for text in (displayed, true))
    assert true_deg > 26.0 and shown_deg == pytest.approx(true_deg, abs=2.0)
