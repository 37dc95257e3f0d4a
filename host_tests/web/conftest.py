"""Fixtures with the site on a server and the page Rides. If the site cannot be built, its tests are skipped."""

import threading

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.web import serve, site
from support.recordings import analysis_rides
from support.web.rider import LAPTOP, Rider
from support.web.rides_page import Rides


@pytest.fixture(scope="session")
def files() -> dict[str, bytes]:
    """Build the site once and return its files, {path: content}."""
    try:
        return site.site_files()
    except InputError as error:
        pytest.skip(f"no packages for the pages: {error}")


@pytest.fixture(scope="session")
def address(files):
    """Start a server of the site and return its address."""
    with serve.server(files, 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://{serve.HOST}:{server.server_address[1]}/"
        server.shutdown()


@pytest.fixture(scope="session")
def ride(tmp_path_factory):
    """Return a ride of half a minute that includes the speed."""
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=50, speed_hz=5)


@pytest.fixture(scope="session")
def calibration(ride):
    return ride.with_name("RIDE.cal.json")


@pytest.fixture(scope="session")
def page(chromium, address):
    """Return one page for all tests, so that Python is loaded only once. The content security policy is enforced."""
    rider = Rider(chromium, address + "rides.html", policy=True, **LAPTOP)
    yield Rides(rider)
    away = [url for url in rider.asked if not url.startswith((address, "blob:" + address, "data:"))]
    rider.context.close()
    assert (away, rider.errors) == ([], [])
