"""The page of `kickstand web` as Chromium shows it, riding through a bend."""

import hashlib
import io
import threading
from pathlib import Path

from kickstand_tools.web import serve, site

_CHROMIUM = Path("/usr/bin/chromium")
_LAPTOP, _PHONE = (1440, 900), (390, 844)
_WAIT_MS = 60_000
_COLOURS = 256  # of the file, so that it is small
_DRAWN = ("index.html", "style.css", "bike.mjs", "road.mjs", "display.mjs")  # what decides how it looks
_SAYS = "text => document.querySelector('#display').ariaLabel.includes(text)"
_TOLD = "text => document.querySelector('#todo').textContent.includes(text)"


def available() -> bool:
    """True if there is a Chromium to take the picture with."""
    return _CHROMIUM.exists()


def looks() -> str:
    """A hash of the page's files that decide how it looks. The picture carries it, so that a test knows a stale one."""
    return hashlib.sha256(b"".join((site.PAGE / name).read_bytes() for name in _DRAWN)).hexdigest()


def draw(size: tuple[int, int] = _LAPTOP, dark: bool = False) -> bytes:
    """The page as a PNG file. size: in pixels."""
    from PIL import Image, PngImagePlugin
    from playwright.sync_api import sync_playwright

    with serve.server(site.site_files(), 0) as server, sync_playwright() as playwright:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = playwright.chromium.launch(executable_path=_CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(
            viewport={"width": size[0], "height": size[1]},
            color_scheme="dark" if dark else "light",
            has_touch=size == _PHONE,
            is_mobile=size == _PHONE,
        )
        page.set_default_timeout(_WAIT_MS)
        page.goto(f"http://{serve.HOST}:{server.server_address[1]}/")
        for says in "Now upright", "Aligned":
            page.wait_for_function(_TOLD, arg="ress the button")
            page.click("#press")
            page.wait_for_function(_SAYS, arg=says)
            page.click("#do")
        page.wait_for_function(_TOLD, arg="Lean it")
        for _ in range(7):
            page.keyboard.press("ArrowRight")
        page.wait_for_function(_TOLD, arg="That is all")
        page.evaluate("document.activeElement.blur()")  # without the ring around the button that has the focus
        shot = page.screenshot()
        browser.close()
        server.shutdown()
    small, marked = io.BytesIO(), PngImagePlugin.PngInfo()
    marked.add_text("looks", looks())
    Image.open(io.BytesIO(shot)).convert("RGB").quantize(_COLOURS).save(small, "PNG", optimize=True, pnginfo=marked)
    return small.getvalue()
