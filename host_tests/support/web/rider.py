"""A rider who uses the page with real clicks and keys, and reads what it shows."""

import os
from pathlib import Path
from typing import Any

import pytest

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
LAPTOP: dict[str, Any] = {"viewport": {"width": 1440, "height": 900}}
READ_S = 120  # longest wait for the page to show something, long enough for a busy machine

# This script keeps the messages of the board's worker, so that tests can check and repeat them. The script also makes
# the page draw less often.
KEEP = Path(__file__).with_name("keep.js").read_text()


class Rider:
    """A rider with a page of the site.

    browser: playwright's browser.
    policy: True to enforce the page's content security policy. With the policy, playwright's wait_for_function() works
        only on the page Rides.
    script: code that runs before each page's own scripts.

    asked: the addresses that the page has requested.
    errors: the errors on the page.
    """

    def __init__(self, browser, address, policy=False, script="", **kind):
        self._browser = browser
        self.context = browser.new_context(bypass_csp=not policy, **kind)
        self.context.set_default_timeout(1000 * READ_S)
        self.context.add_init_script(KEEP)
        self.context.add_init_script(script)
        self.asked, self.errors = [], []
        self.context.on("request", lambda request: self.asked.append(request.url))
        self.page = self.context.new_page()
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: "Security Policy" in said.text and self.errors.append(said.text))
        self.page.goto(address)

    def reads(self, text):
        """Wait until the first line of the display shows this text."""
        self.page.wait_for_function(
            "text => seen.last && document.querySelector('#display').ariaLabel.startsWith(`Display: ${text}`)",
            arg=text,
        )

    def guide_says(self, text):
        """Wait until the guide shows this text."""
        self.page.wait_for_function("text => document.querySelector('#todo').textContent.includes(text)", arg=text)

    def wait(self, seconds):
        """Wait until this much of the board's time has passed."""
        self.page.wait_for_function(
            "until => seen.last.t_s >= until", arg=self.seen("last")["t_s"] + seconds, timeout=1000 * (seconds + READ_S)
        )

    def keys(self, key, times):
        for _ in range(times):
            self.page.keyboard.press(key)

    def click(self, selector):
        self.page.click(selector)

    def seen(self, what):
        """Return the kept messages with this name, one of window.seen in keep.js."""
        return self.page.evaluate(f"seen.{what}")

    def moved(self):
        """Return the layout shifts if they add up to more than 0.01. People notice 0.1.

        If the machine is busy while a page is loading, the browser draws the header in parts, and the header shifts by
        0.001.
        """
        shifts = self.seen("shifts")
        return shifts if sum(shift[0] for shift in shifts) > 0.01 else []

    def text(self, selector):
        return self.page.inner_text(selector)

    def leans(self):
        """Return the true and the shown lean on the page, in degrees, positive to the right."""
        return tuple(_lean_deg(self.text(selector)) for selector in ("#true-lean", "#shown-lean"))

    def align(self):
        """Do the two presses when the guide asks for them."""
        self.guide_says("Press the button")
        self.click("#press")
        self.reads("Now upright")
        self.click("#do")  # the guide's button: hold the bike upright
        self.guide_says("Press the button once more")
        self.click("#press")

    def axe(self):
        """Return the findings of axe-core in the light and the dark style, one line per finding."""
        axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
        violations = []
        for scheme in ("light", "dark"):
            self.page.emulate_media(color_scheme=scheme)
            for rule in axe.run(self.page).response["violations"]:
                violations += [f"{rule['id']}: {node['html']}: {node['failureSummary']}" for node in rule["nodes"]]
        return violations

    def fits(self):
        """Return True if the page is not wider than its window."""
        return self.page.evaluate("document.documentElement.scrollWidth <= innerWidth")

    def strangers(self):
        """Return the requested addresses that are not on the site."""
        home = "/".join(self.asked[0].split("/")[:3]) + "/"
        return [url for url in self.asked if not url.startswith((home, f"blob:{home}", "data:"))]

    def slow(self, times):
        """Slow down the page's own thread by this factor."""
        self.context.new_cdp_session(self.page).send("Emulation.setCPUThrottlingRate", {"rate": times})

    def processes(self):
        """Return the ids of the browser's processes."""
        info = self._browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
        return [process["id"] for process in info["processInfo"]]

    def worker_s(self):
        """Return the processor time that the page's workers have used, in s."""
        ticks = 0
        for process in self.processes():
            for thread in Path(f"/proc/{process}/task").glob("*"):
                if (thread / "comm").read_text().strip() == "DedicatedWorker":
                    fields = (thread / "stat").read_text().rsplit(")", 1)[1].split()
                    ticks += int(fields[11]) + int(fields[12])  # the sum of user time and kernel time
        return ticks / os.sysconf("SC_CLK_TCK")


def _lean_deg(text):
    size, _, side = text.partition("°")
    return -float(size) if side.strip() == "left" else float(size)
