"""The site on a server of its own. Where it cannot be put together, its tests are skipped."""

import threading

import pytest
from kickstand_tools.errors import InputError
from kickstand_tools.web import serve, site


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
