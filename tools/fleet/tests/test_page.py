"""The page of a fleet and the picture of a vehicle: their numbers, their order, and scales that fit the values."""

import re

import pytest
from kickstand_fleet import plot
from kickstand_fleet.manifest import Period
from kickstand_fleet.page import FleetSummary
from kickstand_fleet.period import failed

DAY_S = 86_400.0


def result(vehicle="bus 12", quality_deg=0.5, mount="", kind="car", tests=(), moved=(), errors=(), **changed):
    """Return the result of an aligned vehicle. tests: (Universal Time or None, deceleration) of each brake test."""
    outcome = failed(Period(vehicle, mount, kind, ()), "", "")
    outcome.alignment |= {"status": "aligned", "reason": "", "driven_s": 1800.0, "halves_deg": 0.1, "stops": 7}
    outcome.alignment |= {"quality_deg": quality_deg, "attitude_deg": 1.24, "events_used": 31, "speed_lag_s": 0.34}
    outcome.alignment |= changed
    outcome.moved, outcome.errors = list(moved), list(errors)
    outcome.brake_tests = [{"utc_s": utc_s, "mfdd_mps2": mfdd} for utc_s, mfdd in tests]
    outcome.picture = [[0.1, 0.11, 0.2, 0.21], [-0.3, -0.29, 0.0, 0.02]]
    return outcome


def move(turned_deg, vehicle="v2"):
    moment = {"within_log": True, "at_s": 63.4, "log": "logs/a.csv", "utc_s": 1.79e9}
    return moment | {"vehicle": vehicle, "mount": "", "turned_deg": turned_deg, "turned_sigma_deg": 1.0, "sigmas": 9.0}


def summary_of(*results):
    summary = FleetSummary()
    for outcome in results:
        summary.add(outcome)
    return summary


def words_of(html):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", html))


def test_the_page_has_the_numbers_of_the_fleet():
    tests = [(1.79e9 + k * DAY_S, 4.0 + k) for k in range(3)]
    summary = summary_of(
        result("v1", 0.4, tests=tests, driven_s=16_200.0, plot="plots/v1.svg"),
        result("v2", 0.6, mount="front", moved=[move(12.34)]),
        result("v3", status="refused", reason="mount-moved", message="turn <back>"),
        result("v4", status="error", reason="new-reason"),
    )
    html = summary.page(8)
    words = words_of(html)
    assert "Fleet: 4 of 8 mounted sensors so far" in words and "Fleet: 4 mounted sensors " in words_of(summary.page(4))
    for text in (
        " 2 aligned (50 %)",
        " 1 refused: ",
        " 1 errors: ",
        " 2 whose mount seems to have moved",
        " 3 brake tests",
        " 6.0 hours of driving",
        "the mount seems to have moved 1",
        "new-reason 1",
        "12.3\u00b0 \u00b1 1.0\u00b0 9 sigma at 63 s in a.csv (2026-09-21)",
        "v2 / front 0.60\u00b0 0.1\u00b0 31 7",
        "Standard error of forward, median 0.50\u00b0",
        "Mean fully developed deceleration, median 5.00 m/s\u00b2",
    ):
        assert text in words, text
    assert 'href="plots/v1.svg"' in html and 'title="turn &lt;back&gt;"' in html
    assert "://" not in html.replace("http://www.w3.org/2000/svg", "")
    order = re.findall(r">\s*(v\d+)\b", html.partition("<h2>Vehicles</h2>")[2])
    assert order == ["v3", "v4", "v1", "v2"]  # first those that need attention


def texts(svg):
    return re.findall(r"<text[^>]*>([^<]*)</text>", str(svg))


def test_the_picture_says_how_well_the_vehicle_is_aligned():
    words = texts(plot.draw(result(mount="front")))
    assert words[0] == "bus 12, mount front" and words[1].startswith(
        "forward known to 0.5\u00b0, the whole alignment to"
    )
    assert texts(plot.draw(result(message="a reason")))[:2] == ["bus 12", "a reason"]


@pytest.mark.long
def test_fleet_page_is_readable_in_a_browser(chromium, results, tmp_path):
    """It has the style of the site, and axe finds nothing."""
    from support.web.rider import LAPTOP, PHONE, Rider

    (tmp_path / "index.html").write_text(summary_of(*list(results.values())[1:4:2]).page(2), encoding="utf-8")
    rider = Rider(chromium, (tmp_path / "index.html").as_uri(), **PHONE)
    assert rider.text("h1") == "Kickstand" and rider.text("header p") == "Fleet: 2 mounted sensors"
    for device in PHONE, LAPTOP:
        rider.page.set_viewport_size(device["viewport"])
        assert rider.fits() and rider.axe() == []
    for scheme, paper in (("light", "rgb(244, 242, 236)"), ("dark", "rgb(15, 17, 21)")):
        rider.page.emulate_media(color_scheme=scheme)
        assert rider.page.evaluate("() => getComputedStyle(document.body).backgroundColor") == paper
    assert rider.errors == []
    rider.context.close()
