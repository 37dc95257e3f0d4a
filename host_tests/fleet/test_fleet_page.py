"""A fleet's page has the style of the site and readable colours. A zero does not have the colour of a fault."""

import pytest
from kickstand_fleet.manifest import read_manifest
from kickstand_fleet.period import work_on_period
from kickstand_fleet.show.page import Glance
from support.web.rider import LAPTOP, PHONE, Rider

BACKGROUND = "() => getComputedStyle(document.body).backgroundColor"
COLOUR = "number => getComputedStyle(number).color"
INK = "() => getComputedStyle(document.body).color"


@pytest.fixture(scope="module")
def page_file(fleet, tmp_path_factory):
    """Write the page of a fleet with an aligned vehicle and a moved mount. Return its path."""
    glance = Glance()
    for period in read_manifest(str(fleet.manifest))[1:4:2]:
        glance.add(work_on_period(period))
    path = tmp_path_factory.mktemp("page") / "index.html"
    path.write_text(glance.page(2), encoding="utf-8")
    return path


def test_fleet_page_has_the_sites_style_and_axe_finds_nothing(chromium, page_file):
    rider = Rider(chromium, page_file.as_uri(), **PHONE)
    assert rider.text("h1") == "Kickstand" and rider.text("header p") == "Fleet: 2 mounted sensors"
    for kind in PHONE, LAPTOP:
        rider.page.set_viewport_size(kind["viewport"])
        assert rider.fits() and rider.axe() == []
    for scheme, paper in (("light", "rgb(244, 242, 236)"), ("dark", "rgb(15, 17, 21)")):
        rider.page.emulate_media(color_scheme=scheme)
        assert rider.page.evaluate(BACKGROUND) == paper
        plain = rider.page.evaluate(INK)
        for tile in rider.page.locator(".tile").all():
            number, words = tile.locator("b"), tile.inner_text()
            coloured = number.evaluate(COLOUR) != plain
            faults = ("aligned", "refused", "errors", "moved")
            assert coloured == (number.inner_text() != "0" and any(one in words for one in faults)), words
    assert rider.errors == []
    rider.context.close()
