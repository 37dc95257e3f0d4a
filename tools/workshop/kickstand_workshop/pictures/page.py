"""Records the page of `kickstand web` in Chromium as an animation: two presses, then a bend to each side."""

import contextlib
import hashlib
import io
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

from kickstand_tools.web import serve, site

CHROMIUM = shutil.which("chromium")

NAME = "first_minute.webp"
_SIZE = (1000, 560)
_WIDTH = 720  # width of the picture, in pixels
_WAIT_MS = 60_000
_FRAME_S = 0.2
_QUICKER = 1.5  # factor by which the animation is faster than the page
_LAST_S = 2.5  # duration of the last picture
_QUALITY = 32
_MOST = 100  # largest number of pictures
_LEANS = (("ArrowRight", 7), ("ArrowLeft", 14))  # a key, and how often it is pressed. Each press leans by 5 degrees
_HELD_S = 3.0
_BASE = ("../templates/base.html", "../../common/theme.css")
# Files that determine the page's look
_LOOK_FILES = (*_BASE, "index.html", "style.css", "bike.mjs", "road.mjs", "display.mjs", "guide.mjs")
_SAYS = "text => document.querySelector('#display').ariaLabel.includes(text)"
_ASKS = "text => document.querySelector('#todo').textContent.includes(text)"


@contextlib.contextmanager
def opened(files: dict[str, bytes]) -> Iterator[tuple[Any, str]]:
    """A context that serves these files. The context yields playwright's browser and the server's address."""
    from playwright.sync_api import sync_playwright

    with serve.server(files, 0) as server, sync_playwright() as playwright:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            yield browser, f"http://{serve.HOST}:{server.server_address[1]}/"
        finally:
            browser.close()
            server.shutdown()


def look_hash() -> str:
    """Return a hash of the files that determine the page's look.

    The picture contains this hash, so a test can find a picture that is out of date.
    """
    return hashlib.sha256(b"".join((site.PAGE / name).read_bytes() for name in _LOOK_FILES)).hexdigest()


def draw() -> bytes:
    """Return the first minute on the page as an animated WebP file."""
    with opened(site.site_files()) as (chromium, address):
        page = chromium.new_page(viewport={"width": _SIZE[0], "height": _SIZE[1]}, color_scheme="light")
        page.set_default_timeout(_WAIT_MS)
        page.goto(address)
        shots = _ride(page)
    return _animated(shots)


def _ride(page: Any) -> list[tuple[float, bytes]]:
    """Use the page as a rider does. Returns the pictures of the page with their times in s, one per _FRAME_S."""
    shots: list[tuple[float, bytes]] = []

    def film(is_over: Callable[[], bool]) -> None:
        """Take a picture every _FRAME_S, or as often as the page can, until is_over()."""
        due_s = time.monotonic()
        end_s = due_s + _WAIT_MS / 1000
        while not is_over():
            if due_s > end_s:
                raise TimeoutError("the page does not go on")
            shots.append((time.monotonic(), page.screenshot()))
            due_s = max(due_s + _FRAME_S, time.monotonic())
            time.sleep(max(0.0, due_s - time.monotonic()))

    def says(question: str, text: str) -> Callable[[], bool]:
        return lambda: page.evaluate(question, text)

    def seconds(count: float) -> Callable[[], bool]:
        end = time.monotonic() + count
        return lambda: time.monotonic() > end

    page.wait_for_function(_ASKS, arg="ress the button")
    film(seconds(1.0))
    for shown in "Now upright", "Aligned":
        film(says(_ASKS, "ress the button"))
        page.click("#press")
        film(says(_SAYS, shown))
        film(seconds(0.8))
        page.click("#do")
    film(says(_ASKS, "Lean it"))
    for key, times in _LEANS:
        for _ in range(times):
            page.keyboard.press(key)
        film(seconds(_HELD_S))
    return shots


def _animated(shots: list[tuple[float, bytes]]) -> bytes:
    """Return the pictures as an animation (WebP). shots: pictures with their times in s."""
    from PIL import Image

    shots = shots[:: -(-len(shots) // _MOST)]
    size = (_WIDTH, _WIDTH * _SIZE[1] // _SIZE[0])
    pictures = [Image.open(io.BytesIO(shot)).convert("RGB").resize(size, Image.Resampling.LANCZOS) for _, shot in shots]
    times = [time_s for time_s, _ in shots]
    lasting = [round(1000 * (end - begin) / _QUICKER) for begin, end in pairwise(times)] + [round(1000 * _LAST_S)]
    content = io.BytesIO()
    style = {"quality": _QUALITY, "method": 5, "loop": 0}
    pictures[0].save(
        content, "WEBP", save_all=True, append_images=pictures[1:], duration=lasting, xmp=look_hash().encode(), **style
    )
    return content.getvalue()
