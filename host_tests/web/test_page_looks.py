"""The pages are accessible: axe-core finds no problem, in the light and the dark style, on a phone and on a laptop."""

import pytest
from support.web.rider import LAPTOP, PHONE, Rider

PAGES = {"": "Try", "install.html": "Install", "live.html": "Live"}


@pytest.mark.parametrize("name", PAGES)
def test_axe_finds_nothing(chromium, address, name):
    """Each page is checked on a phone. Colours and names are the same on a laptop, so only the page with the most
    content is also checked there."""
    rider = Rider(chromium, address + name, **PHONE)
    assert rider.text("nav [aria-current]") == PAGES[name]
    if not name:
        rider.reads("Raw")
    assert rider.fits() and rider.axe() == []
    rider.page.set_viewport_size(LAPTOP["viewport"])
    assert rider.fits()
    assert name or rider.axe() == []
    rider.context.close()


def test_a_phones_first_screen_has_all_for_the_first_minute(chromium, address):
    rider = Rider(chromium, address, **PHONE)
    tops = rider.page.eval_on_selector_all("main > section", "all => all.map((one) => one.getBoundingClientRect().top)")
    assert tops == sorted(tops), "what arrives first is seen first, or the page moves while it loads"
    rider.reads("Raw")
    for selector in ("#display", "#press", "#todo", "#scene", "#shown-lean", "#pose"):
        box = rider.page.locator(selector).bounding_box()
        assert box["y"] + box["height"] <= PHONE["viewport"]["height"], selector
    rider.page.tap("#press")
    rider.reads("Stand: hold")
    rider.page.tap("#wire")
    rider.guide_says("wire is out")
    rider.reads("No sensor")
    assert rider.page.locator("#display").bounding_box()["y"] >= 0, "what the fault does is not in sight"
    device, guide = (rider.page.locator(one).bounding_box() for one in (".device", ".guide"))
    assert guide["y"] >= device["y"] + device["height"], "what the guide says of it is not in sight"
    rider.page.tap("#power")
    rider.guide_says("display is dark")
    assert rider.moved() == []
    rider.context.close()


def test_a_phone_leans_the_motorcycle_if_it_has_motion_data(chromium, address):
    """The page's introduction is visible. A screen reader clicks without a pointer, and such a click also presses the
    button."""
    rider = Rider(chromium, address, **PHONE)
    rider.page.set_viewport_size({"width": 820, "height": 1180})
    rider.reads("Raw")
    assert rider.page.is_visible("header p")
    rider.page.eval_on_selector("#press", "button => button.click()")
    rider.reads("Stand: hold")
    rider.page.tap("#tilt")
    rider.page.wait_for_selector("#tilt-said:has-text('does not say how it is held')")
    assert rider.page.get_attribute("#tilt", "aria-pressed") == "false"
    rider.page.set_viewport_size(PHONE["viewport"])
    phone = rider.context.new_cdp_session(rider.page)

    def tilt(gamma):
        phone.send("DeviceOrientation.setDeviceOrientationOverride", {"alpha": 0, "beta": 40, "gamma": gamma})

    tilt(3)
    rider.page.tap("#tilt")
    rider.page.wait_for_function("document.querySelector('#tilt').ariaPressed === 'true'")
    assert rider.page.get_attribute("#pose [value=ride]", "aria-pressed") == "true"
    rider.page.wait_for_timeout(200)
    tilt(23)
    rider.page.wait_for_function("document.querySelector('#lean-out').value === '20° right'")
    rider.page.wait_for_function("seen.last.lean_deg > 15")
    rider.context.close()


def test_nothing_is_below_the_choice_of_the_display(chromium, address):
    """No text is below the choice, even in a narrow window of a computer, where the page also explains the keys."""
    rider = Rider(chromium, address, viewport={"width": 390, "height": 844})
    for width in (360, 390, 420, 480, 512, 560, 800):
        rider.page.set_viewport_size({"width": width, "height": 844})
        words = rider.page.evaluate(
            "() => { const all = document.createRange(); all.selectNodeContents(document.querySelector('#press-help'));"
            " return all.getBoundingClientRect().right; }"
        )
        choice = rider.page.locator("#kind").bounding_box()
        beside = rider.page.locator("#press-help").bounding_box()["y"] < choice["y"] + choice["height"]
        assert words <= choice["x"] or not beside, width
    rider.context.close()


def test_motorcycle_is_seen_in_the_dark(chromium, address):
    """Mirrors, frame and tyre differ in colour from the road behind them."""
    rider = Rider(chromium, address, color_scheme="dark", **LAPTOP)
    rider.page.wait_for_selector(".mirror")
    colours = (
        "() => { const style = (one) => getComputedStyle(document.querySelector(one));"
        " const of = (one, name) => style(one)[name].match(/[0-9]+/g).map(Number);"
        " const road = document.createElement('p'); road.style.color = 'var(--road)'; road.id = 'paint';"
        " document.body.append(road); return [of('#paint', 'color'), of('.mirror', 'fill'), of('.frame', 'stroke'),"
        " of('.tyre', 'stroke')]; }"
    )
    road, *parts = rider.page.evaluate(colours)
    assert all(sum(part) - sum(road) > 130 for part in parts), (road, parts)
    rider.context.close()
