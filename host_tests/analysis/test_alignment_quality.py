"""A report finds the alignment errors of a ride, their effect on the lean, and the remedy. The rides in the tests have
known alignment errors."""

import dataclasses
import re

import numpy as np
import pytest
from kickstand_tools.analysis import report
from kickstand_tools.analysis.alignment_quality import Quality, lean_cost, yaw_cost_deg
from kickstand_tools.analysis.report import angles
from kickstand_tools.api import Log, fit_drive, fit_two_positions, open_ride, overview, simulate_ride, vehicle_channels
from kickstand_tools.checks.bends import LeftHanded
from kickstand_tools.checks.log import Mirrored
from kickstand_tools.checks.mount import ForwardExchanged
from kickstand_tools.estimation.smooth import PoseOff
from kickstand_tools.signals import rotation_matrix
from kickstand_tools.simulation.scripted import script
from support import command
from support.recordings import analysis_rides

NONE = np.zeros(1)
# The axis of each alignment error. With an error of roll, "up" leans to the right of the bike's up. With an error of
# pitch, "forward" points up. With an error of yaw, "forward" points to the right.
AXES = {"roll": (0.0, 0.0, -1.0), "pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0)}


def turn(name, degrees):
    """Return the rotation matrix that adds an error of `degrees` to the angle `name` of the alignment."""
    return rotation_matrix(np.radians(degrees) * np.array(AXES[name]))


def turned(calibration, name, degrees):
    """Return the calibration with an alignment error of `degrees` in the angle `name`."""
    matrix = turn(name, degrees) @ calibration.vehicle_from_sensor
    return dataclasses.replace(calibration, vehicle_from_sensor=matrix)


@pytest.fixture(scope="module", params=["street", pytest.param("city", marks=pytest.mark.nightly)])
def ride(request):
    """Return a log of 100 samples per second with a speed, its true calibration, the true lean and the profile."""
    made = simulate_ride(request.param, seed=2, seconds=150.0)
    n = round(made.rate_hz / 100.0)
    readings = made.readings[: len(made.readings) // n * n].reshape(-1, n, 7).mean(axis=1)
    log = Log.from_readings(readings, made.rate_hz / n)
    log.speed_mps[::100] = made.truth["speed_mps"][n - 1 :: n][: len(readings)][::100]
    kickstand, upright = (Log.from_readings(pose, made.rate_hz) for pose in (made.kickstand, made.upright))
    calibration = fit_drive([log], fit_two_positions(kickstand, upright).calibration, "motorcycle").calibration
    return log, calibration, made.truth["lean_deg"][n - 1 :: n][: len(readings)], request.param


def error_deg(ride, calibration, from_share=0.0):
    """Return the rms error of the displayed lean while it is trusted and the bike moves, or infinity if no lean is
    trusted."""
    log, _, true, _ = ride
    shown = vehicle_channels(log, calibration)
    there = shown.trusted & (shown.resting < 0.5)
    there[: round(from_share * len(there))] = False
    return float(np.sqrt(np.mean((shown.lean_deg - true)[there] ** 2))) if np.any(there) else np.inf


@pytest.mark.parametrize(("name", "degrees"), [("yaw", 6.0), ("yaw", 15.0), ("pitch", 6.0), ("pitch", 12.0)])
def test_yaw_and_pitch_cause_the_stated_lean_error(ride, name, degrees):
    """Errors in both directions are tried, because one error may compensate another."""
    usual = error_deg(ride, ride[1])
    more = [error_deg(ride, turned(ride[1], name, angle)) for angle in (degrees, -degrees)]
    cost = np.sqrt(max(0.0, np.mean(np.square(more)) - usual**2))
    angles = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0} | {f"{name}_deg": degrees}
    said = vars(lean_cost(Quality(**angles, gravity_g=1.0, straight_s=60.0, lateral_g=NONE, forward_g=NONE)))
    most = said.pop(f"{name}_deg")
    assert cost < 1.75 * most + 0.15
    if ride[3] != "city":  # in slow rides an alignment error costs less
        assert cost > 0.3 * most
    assert set(said.values()) == {0.0}


def test_riding_corrects_roll_up_to_a_limit(ride):
    usual = error_deg(ride, ride[1], 0.5)
    assert error_deg(ride, turned(ride[1], "roll", 3.0), 0.5) < usual + 0.3
    assert error_deg(ride, turned(ride[1], "roll", 12.0), 0.5) > 7.0  # the error is infinite if no lean is shown at all


def test_calibrate_drive_corrects_yaw(ride):
    log, calibration, *_ = ride
    found = fit_drive([log], turned(calibration, "yaw", 9.0), "motorcycle").calibration
    before, after = (overview(open_ride(log, one)).quality.yaw_deg for one in (turned(calibration, "yaw", 9.0), found))
    assert before is not None
    assert after is not None
    assert abs(abs(before) - 9.0) < 2.5
    assert abs(after) < 2.0
    assert found.vehicle_from_sensor == pytest.approx(calibration.vehicle_from_sensor, abs=0.02)


def with_calibration(ride, name, degrees, **changed):
    """Write a CAL.json whose alignment has an error of `degrees` in the angle `name`. Return its path."""
    matrix = turn(name, degrees).tolist()
    return analysis_rides.calibration(ride.with_name(f"{name}.json"), vehicle_from_sensor=matrix, **changed)


@pytest.fixture(scope="module")
def scripted(tmp_path_factory):
    """Simulate straights and turns between standstills, with one speed per second."""
    segments = [script.upright(4)]
    for lean in 25, -30, 20:
        segments += [script.accelerate(16, 5), script.straight(6), script.turn(lean, 4), script.straight(5)]
        segments += [script.brake(0, 4), script.wait(4)]
    return analysis_rides.write(tmp_path_factory.mktemp("ride"), segments, speed_hz=1)


@pytest.mark.parametrize(("axis", "angle_deg"), list(zip(AXES, (-3.0, 2.0, -3.0), strict=True)))
def test_alignment_error_is_found(scripted, axis, angle_deg):
    quality = overview(open_ride(scripted, with_calibration(scripted, axis, angle_deg))).quality
    assert quality.straight_s > 30.0
    for name in AXES:
        value = getattr(quality, f"{name}_deg")
        assert value == pytest.approx(angle_deg if name == axis else 0.0, abs=0.4), name
    assert quality.gravity_g == pytest.approx(1.0, abs=0.002)


def test_ride_without_straights_shows_no_alignment(tmp_path):
    path = analysis_rides.write(tmp_path, [script.upright(8)])
    quality = overview(open_ride(path, None)).quality
    assert (quality.roll_deg, quality.pitch_deg, quality.yaw_deg) == (None, None, None)
    said = command.works("report", path).out
    assert "Alignment: not enough straight riding to know how far it is off." in said


@pytest.mark.parametrize(
    ("notice", "fits"), [(Mirrored(), False), (LeftHanded(), False), (ForwardExchanged(False, "left", 0.0), True)]
)
def test_a_log_that_contradicts_its_calibration_is_not_judged(scripted, notice, fits):
    """In a mirrored log the alignment angles look right, although left and right are exchanged."""
    seen = overview(open_ride(scripted, with_calibration(scripted, "yaw", 0.0)))
    seen.notices.append(notice)
    assert ("not judged" not in report.words(seen).alignment) == fits
    assert (report.as_data(seen)["alignment"]["roll_deg"] is not None) == fits


def test_zero_is_never_shown_as_minus_zero():
    assert angles(Quality(-0.04, None, 2.04, None, 60.0, NONE, NONE)) == ["roll +0.0°", "yaw +2.0°"]


@pytest.mark.parametrize(
    ("name", "degrees", "words"),
    [
        ("yaw", 5.0, r"yaw [+-]5\.\d°\. Yaw usually costs about 0\.3° of lean; calibrate ride or drive takes it out\."),
        (
            "yaw",
            2.6,
            r"^Alignment: good\..*yaw [+-]2\.[67]°, which costs less than 0\.25° .* At rest .* are allowed\.$",
        ),
        ("roll", 3.0, r"^Alignment: good\..*roll [+-]3\.0°.*, which costs less than 0\.25° of lean\."),
        ("roll", 9.0, r"roll [+-]9\.0°.*: was it held upright\? Roll usually costs about 5\.5° of lean; cal"),
        ("pitch", 4.0, r"pitch [+-]3\.\d°.* Pitch usually costs about 0\.3° of lean; calibrate ride takes it out, or"),
    ],
)
def test_report_gives_the_cost_of_an_error_and_the_remedy(scripted, name, degrees, words):
    seen = overview(open_ride(scripted, with_calibration(scripted, name, degrees)))
    assert re.search(words, report.words(seen).alignment)
    cost = report.as_data(seen)["lean_cost"][f"{name}_deg"]
    most = {"yaw": yaw_cost_deg(degrees), "roll": max(0.0, degrees - 3.5), "pitch": 0.33}[name]
    assert cost == pytest.approx(most, abs=0.05)
    car = with_calibration(scripted, name, degrees, vehicle="car")
    # a car has no lean that an error could make worse
    assert "lean_cost" not in report.as_data(overview(open_ride(scripted, car)))


def test_alignment_is_good_if_fully_known_and_exact(scripted):
    seen = overview(open_ride(scripted, with_calibration(scripted, "yaw", 2.6)))
    assert report.words(seen).alignment.startswith("Alignment: good.")
    # the errors of yaw and pitch cost 0.14 and 0.17 degrees of lean
    dear = dataclasses.replace(seen.quality, pitch_deg=2.0)
    for quality in (dataclasses.replace(seen.quality, yaw_deg=None), dear):
        said = report.words(dataclasses.replace(seen, quality=quality)).alignment
        assert said.startswith("Alignment: it seems off by ")
    far = dataclasses.replace(seen.quality, roll_deg=11.0)
    exchanged = ForwardExchanged(False, "left", 11.0)
    swapped = dataclasses.replace(seen, quality=far, notices=[exchanged])
    assert ": were the poses swapped?" in report.words(swapped).alignment
    off = dataclasses.replace(seen, notices=[*seen.notices, PoseOff(2.0)])
    assert not report.words(off).alignment.startswith("Alignment: good")


def test_wrong_force_at_rest_asks_for_six_positions(scripted):
    cal = with_calibration(scripted, "yaw", 0.0, accel_slope=[1.05] * 3)
    said = report.words(overview(open_ride(scripted, cal)), on_page=True).alignment
    assert said.endswith("At rest the force is 1.051 g and not 1: the six positions of the sensor take that out.")


def test_calibrate_drive_is_not_advised_without_a_speed(scripted, tmp_path):
    log = tmp_path / "RIDE.csv"
    log.write_text("\n".join(row.rpartition(",")[0] for row in scripted.read_text().splitlines()) + "\n")
    said = report.words(overview(open_ride(log, with_calibration(scripted, "yaw", 5.0)))).alignment
    assert "calibrate ride takes it out" in said
    assert "calibrate drive" not in said
