"""The page Rides shows the same as the commands, and sends no file to a server."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.analysis.overview import overview
from kickstand_tools.analysis.plot import charts, interactive
from kickstand_tools.analysis.ride import open_ride
from support import command
from support.command import works
from support.recordings import analysis_rides, app_exports
from support.web.rider import LAPTOP, MISSING, PHONE, Rider
from support.web.rides_page import WAIT_MS, Rides, assert_near, near

AWAKE = """() => {
  let last = performance.now();
  window.longestMs = 0;
  setInterval(() => {
    window.longestMs = Math.max(window.longestMs, performance.now() - last);
    last = performance.now();
  }, 50);
}"""


def test_the_report_is_that_of_the_command(page, ride, calibration):
    page.show(ride, calibration)
    reported = json.loads(works("report", ride, "--json").out)
    shown = json.loads(page.saved("#save-json"))
    assert shown.pop("ride") == Path(reported.pop("ride")).name
    assert_near(shown, reported)
    wide = works("report", ride).out.split()
    for row in page.report():
        assert [word for cell in row for word in cell.split() if word not in wide] == []
    assert len(page.report()) == 10
    assert page.warnings() == ""


def test_the_charts_are_those_of_the_command(page, ride, calibration):
    page.show(ride, calibration)
    drawn = interactive.figure(charts.charts(overview(open_ride(ride, calibration, smoothed=True))))["data"]
    inside = page.page.frame_locator("#plot")
    inside.locator("#chart .main-svg").first.wait_for()
    assert inside.locator("#chart").evaluate("() => window.origin") == "null", "the frame has rights"
    assert inside.locator("#map").count() == 0
    shown = json.loads(inside.locator("#chart").evaluate("() => JSON.stringify(CHART.data)"))
    assert [trace.get("name") for trace in shown] == [trace.get("name") for trace in drawn]
    for was, now in zip(drawn, shown):
        for axis in "xy":
            assert near(now[axis], was[axis], 0.002), was.get("name")
    html = page.saved("#save-page").decode()
    assert "Plotly.newPlot" in html and "src=" not in html.split("<body>")[0].rpartition("</script>")[2]
    assert '<script src="' not in html and "<h1>RIDE</h1>" in html
    frame = page.page.locator("#plot").bounding_box()
    assert frame["height"] > 900  # the frame is as high as its charts and needs no scroll bar


def test_the_lean_of_each_sample_is_that_of_the_command(page, ride, calibration, tmp_path):
    page.show(ride, calibration)
    works("smooth", ride, "--out", tmp_path / "lean.csv")
    (tmp_path / "shown.csv").write_bytes(page.saved("#save-lean"))
    was, now = (analysis_rides.table(tmp_path / name) for name in ("lean.csv", "shown.csv"))
    assert now.dtype.names == was.dtype.names and len(now) == len(was) > 1000
    for name in was.dtype.names or ():
        assert near(now[name], was[name], 0.002), name
    assert page.page.is_visible("#report")


def test_missing_file_of_the_site_is_not_saved(page, ride, calibration):
    page.show(ride, calibration)
    page.page.evaluate(MISSING, ["plotly.min.js", 404])
    page.page.click("#save-page")
    assert "plotly.min.js cannot be loaded (HTTP 404)" in page.said()
    page.page.evaluate("given()")
    assert b"Plotly.newPlot" in page.saved("#save-page")


def test_page_does_not_wait_for_impossible_charts(page, ride, calibration):
    before = list(page.rider.errors)
    page.page.evaluate(MISSING, ["plotly.min.js", 200])
    page.give(ride, calibration)
    page.page.wait_for_function("document.querySelector('#drawing').textContent.includes('could not draw')")
    page.page.evaluate("given()")
    page.give(ride, calibration)
    page.page.wait_for_function("document.querySelector('#drawing').hidden")
    page.rider.errors[:] = before  # ignore the errors of the frame, whose library is missing


def test_too_short_ride_is_reported_at_the_top(page, calibration, tmp_path):
    """The page shows the command's message. A bike at rest with a running engine is not a ride."""
    random = np.random.default_rng(1)
    readings = random.normal(0.0, [0.03] * 3 + [1.0] * 3, (1200, 6)) + [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    rows = [",".join(f"{value:.4f}" for value in (k / 100.0, *row)) for k, row in enumerate(readings.tolist())]
    (tmp_path / "RIDE.csv").write_text("\n".join([command.HEADER, *rows]) + "\n")
    (tmp_path / "RIDE.cal.json").write_bytes(calibration.read_bytes())
    assert page.give(tmp_path / "RIDE.csv", tmp_path / "RIDE.cal.json") == ""
    said = page.page.inner_text("#too-little")
    assert said == "0:12 of log, all of it standing: too little for a report."
    assert said in works("report", tmp_path / "RIDE.csv").out
    assert page.report()[0][2] == "riding 0:00"
    assert page.page.is_hidden("#terms")


def test_charts_follow_the_dark_theme(page, ride, calibration):
    page.show(ride, calibration)
    chart = page.page.frame_locator("#plot").locator("#chart")
    for scheme, filtered, paper in (("dark", True, "rgb(26, 29, 36)"), ("light", False, "rgb(255, 255, 255)")):
        page.page.emulate_media(color_scheme=scheme)
        shown = chart.evaluate(
            "(chart) => [getComputedStyle(chart).filter, getComputedStyle(chart.ownerDocument.body).backgroundColor]"
        )
        assert (shown[0] != "none", shown[1]) == (filtered, paper)


def test_values_at_the_pointer_are_in_one_line(page, ride, calibration):
    """The page keeps only two of the chart library's many buttons."""
    page.show(ride, calibration)
    inside = page.page.frame_locator("#plot")
    inside.locator("#chart .main-svg").first.wait_for()
    assert inside.locator("#chart .modebar-btn").count() == 2
    page.page.locator("#plot").scroll_into_view_if_needed()
    lean = inside.locator("#chart .nsewdrag").first.bounding_box()
    for share in (0.3, 0.5, 0.7):
        for height in (0.3, 0.4, 0.5, 0.6, 0.7):
            page.page.mouse.move(lean["x"] + share * lean["width"], lean["y"] + height * lean["height"])
            page.page.wait_for_timeout(60)
            if re.fullmatch(r"0:\d\d, \d+°( left| right)?", inside.locator("#tip").text_content() or ""):
                return
    raise AssertionError("nothing is said")


@pytest.mark.nightly  # the tests outside the nightly run cover the page Install, which is built in the same way
def test_once_used_it_works_without_a_network(chromium, address, ride, calibration):
    rider = Rider(chromium, address + "rides.html", **LAPTOP)
    page = Rides(rider)
    assert page.give(ride, calibration) == ""
    page.page.frame_locator("#plot").locator("#chart .main-svg").first.wait_for()
    rider.context.set_offline(True)
    page.page.reload()
    assert "Now add the ride" in page.give(calibration)
    assert page.give(ride, calibration) == ""
    page.page.frame_locator("#plot").locator("#chart .main-svg").first.wait_for()
    rider.context.close()


def test_long_work_can_be_stopped(page, ride, calibration):
    """After the stop, the page can read other files."""
    page.give()
    page.page.set_input_files("#files", [ride, calibration])
    page.page.click("#stop")
    assert page.said() == "Stopped."
    assert len(page.held()) == 2
    page.page.click("#again")
    page.page.wait_for_function("!document.querySelector('#work').hidden")
    before = page.page.workers
    assert page.add(ride, calibration) == ""
    assert page.page.inner_text("#report-title") == "RIDE.csv"
    assert not set(before) & set(page.page.workers)


def test_stopped_work_leaves_no_dead_buttons(page, ride, calibration):
    page.show(ride, calibration)
    page.page.evaluate("['#save-lean', '#stop'].forEach((button) => document.querySelector(button).click())")
    assert page.said() == "Stopped."
    assert page.page.is_hidden("#report") and page.page.is_hidden("#charts")


@pytest.mark.parametrize("kind", [LAPTOP, pytest.param(PHONE, marks=pytest.mark.nightly)], ids=["laptop", "phone"])
def test_axe_finds_nothing(page, ride, calibration, kind):
    page.page.set_viewport_size(kind["viewport"])
    page.show(ride, calibration)
    assert page.rider.axe() == []
    assert page.rider.fits()
    page.page.set_viewport_size(LAPTOP["viewport"])


@pytest.mark.nightly
def test_page_responds_while_reading_thirty_megabytes(chromium, address, calibration, tmp_path):
    """The log lasts more than half an hour at 200 samples per second. The memory of the page hardly
    grows."""
    short = app_exports.riding()
    readings = np.column_stack((short.force_g, short.rates_dps))
    lines = [",".join(f"{value:.7f}" for value in row) for row in readings.tolist()]
    log = tmp_path / "RIDE.csv"
    with open(log, "w") as file:
        file.write("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n")
        file.writelines(f"{k / 200.0:.3f},{lines[k % len(lines)]}\n" for k in range(420_000))
    assert log.stat().st_size > 30e6
    rider = Rider(chromium, address + "rides.html")
    rider.page.evaluate(AWAKE)
    Rides(rider).page.set_input_files("#files", [log, calibration])
    rider.page.wait_for_function("document.querySelector('#work').hidden", timeout=10 * WAIT_MS)
    assert rider.page.inner_text("#said") == ""
    assert rider.page.inner_text("#figures td").startswith("35:00")
    assert rider.page.evaluate("longestMs") < 1500.0
    assert max(rss_mb(process) for process in rider.processes()) < 750.0
    rider.context.close()


def rss_mb(process):
    """Return the resident memory of a process in MB. process: its id."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024.0
