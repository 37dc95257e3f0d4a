"""The site on a server of its own, and Debian's Chromium to look at it. Where one is missing, its tests are skipped."""

import importlib.util
import threading
from pathlib import Path

import pytest
from kickstand_tools.errors import InputError
from kickstand_tools.web import serve, site

CHROMIUM = Path("/usr/bin/chromium")

@pytest.fixture(scope="session")
def files() -> dict[str, bytes]:
    """The site's files."""
    try:
        return site.site_files()
    except InputError as error:
        pytest.skip(f"the site cannot be put together: {error}")


@pytest.fixture(scope="session")
def address(files):
    """Of a server of the site."""
    with serve.server(files, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://{serve.HOST}:{server.server_address[1]}/"
        server.shutdown()


@pytest.fixture(scope="session")
def chromium():
    """The browser, of playwright."""
    if not CHROMIUM.exists():
        pytest.skip(f"no {CHROMIUM}: on Debian the package chromium")
    if importlib.util.find_spec("playwright") is None:
        pytest.skip("no playwright")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()
