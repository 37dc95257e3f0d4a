"""Opens the site of `kickstand web` in a headless Chromium."""

import contextlib
import shutil
import threading
from collections.abc import Iterator
from typing import Any

from kickstand_tools.web import serve

CHROMIUM = shutil.which("chromium")


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
