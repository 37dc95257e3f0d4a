"""Measures the size of the site's pages, and their loading time on a phone with a quarter of this computer's speed.

Run it with

    .venv/bin/python -m kickstand_workshop.page_costs
"""

import gzip
import statistics
import sys
from typing import Any, NamedTuple

from kickstand_tools.web import site

from .pictures.page import CHROMIUM, opened

PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
READY = {  # selectors of the element that is usable when the page is ready, by page
    "": "#kind:enabled",  # the firmware has started
    "install.html": "#look:visible, #unable:visible",
    "live.html": "#simulated:enabled",
    "rides.html": "#sample:enabled",
}
SLOWER = 4
RUNS = 3
_PAINT = "performance.getEntriesByName('first-contentful-paint')[0].startTime"


class PageFigures(NamedTuple):
    """The figures of a page that is opened for the first time."""

    paint_ms: float  # time until the first paint
    ready_ms: float  # time until the page can be used
    size: int  # bytes of the compressed files that the page loads until it is ready


def measure(browser: Any, address: str, files: dict[str, bytes], name: str) -> PageFigures:
    """Open a page and measure it.

    browser: playwright's browser.
    address: Address of a server of the site.
    files: Files of the site.
    name: The page, a key of READY.
    """
    context = browser.new_context(service_workers="block", **PHONE)
    requests: set[str] = set()
    context.on("request", lambda request: requests.add(request.url.removeprefix(address)))
    page = context.new_page()
    context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": SLOWER})
    page.goto(address + name)
    page.wait_for_selector(READY[name])
    ready_ms = page.evaluate("performance.now()")
    size = sum(len(gzip.compress(files[path or "index.html"])) for path in requests if (path or "index.html") in files)
    figures = PageFigures(page.evaluate(_PAINT), ready_ms, size)
    context.close()
    return figures


def main() -> None:
    """Measure each page RUNS times, and print the medians."""
    if CHROMIUM is None:
        sys.exit("no Chromium: on Debian the package chromium")
    files = site.site_files()
    with opened(files) as (browser, address):
        for name in READY:
            runs = [measure(browser, address, files, name) for _ in range(RUNS)]
            paint_ms, ready_ms, size = map(statistics.median, zip(*runs))
            print(
                f"{name or 'index.html':12} paint {paint_ms:5.0f} ms  ready {ready_ms:5.0f} ms  {size / 1000:5.0f} kB"
            )


if __name__ == "__main__":
    main()
