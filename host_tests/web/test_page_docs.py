"""The documents as pages in Chromium: they fit, are accessible, and can be printed."""

import pytest
from support.web.rider import LAPTOP, PHONE, Rider

pytestmark = pytest.mark.long
TABLET = {"viewport": {"width": 820, "height": 1180}}


@pytest.mark.parametrize("kind", [PHONE, TABLET, LAPTOP], ids=["phone", "tablet", "laptop"])
def test_a_page_fits_and_axe_finds_nothing(chromium, address, kind):
    rider = Rider(chromium, address + "docs/device.html", **kind)
    for name in "docs/device.html", "docs/how-it-works.html":
        rider.page.goto(address + name)
        assert rider.text("header nav [aria-current]") == "Docs" and rider.fits()
        assert rider.page.locator("nav.all:visible, nav.here:visible, .quick summary:visible").count() == 2
        assert kind is TABLET or rider.axe() == []
    if kind is PHONE:  # a heading is two touches away
        rider.page.tap(".quick summary:has-text('On this page')")
        rider.page.tap(".quick a:has-text('Glossary')")
        rider.page.wait_for_function("document.querySelector('#glossary').getBoundingClientRect().top < 200")
    assert rider.errors == [] and rider.strangers() == []
    rider.context.close()


def test_on_paper_there_is_the_text_alone(chromium, address):
    rider = Rider(chromium, address + "docs/device.html", **LAPTOP)
    page = rider.page
    page.set_viewport_size({"width": 673, "height": 1000})  # the width of A4 paper without margins
    page.emulate_media(media="print", color_scheme="dark")
    hidden = page.locator("header, footer, main nav, .quick").all()
    assert hidden and not any(element.is_visible() for element in hidden)
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)" and rider.fits()
    cut = "all => all.filter((one) => one.scrollWidth > one.clientWidth + 1).length"
    assert page.eval_on_selector_all("article .wide, article pre", cut) == 0
    rider.context.close()
