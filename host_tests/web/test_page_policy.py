"""The pages' content security policy blocks nothing that the pages need. Most other tests switch the policy off. The
tests of the page Rides enforce it."""

import re

from support.web.rider import LAPTOP, Rider

BOARD_PAGES = ("live.html", "install.html")
PYTHON = "() => import('./python.mjs').then((m) => m.loadPython([])).then((python) => python.runPython('6 * 7'))"

FOREIGN = """() => {
  const script = document.createElement("script");
  script.textContent = "window.ours = 1";
  document.body.append(script);
}"""


def within(chromium, address, name):
    rider = Rider(chromium, address + name, policy=True, **LAPTOP)
    rider.page.wait_for_load_state("networkidle")
    return rider


def test_try_runs_and_a_foreign_script_does_not(chromium, address):
    rider = within(chromium, address, "")
    rider.page.locator('#display[aria-label^="Display: "]').wait_for()
    assert rider.errors == []
    rider.page.evaluate(FOREIGN)
    assert rider.page.evaluate("() => window.ours") is None
    assert "Content Security Policy" in rider.errors[0]
    rider.context.close()


def test_python_runs_in_the_pages_that_speak_to_a_board(chromium, address, files):
    policies = [re.findall(rb'Content-Security-Policy" content="([^"]+)', files[name]) for name in BOARD_PAGES]
    assert len(policies[0]) == 1 and policies[0] == policies[1]
    rider = within(chromium, address, BOARD_PAGES[0])
    assert rider.page.evaluate(PYTHON) == 42
    assert rider.errors == []
    rider.context.close()
