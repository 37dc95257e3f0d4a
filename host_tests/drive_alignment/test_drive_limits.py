"""Alignment by driving: its limits in numbers, met from both sides, piece by piece."""

import math
import types

import pytest
from kickstand.drive_alignment import verdict
from kickstand.drive_alignment.alignment import (
    BRAKING,
    READY,
    REFUSED,
    TURNING,
    WAITING_FOR_BRAKING,
    WAITING_FOR_SPEED,
    WAITING_FOR_STOP,
    DriveAlignment,
)
from kickstand.drive_alignment.events import DrivingEvents, EventFinder, LastEvent
from kickstand.drive_alignment.history import ForceHistory
from kickstand.drive_alignment.quality import DrivingQuality
from kickstand.drive_alignment.speed_check import SpeedCheck, fit_problem
from kickstand.drive_alignment.vertical import StandingVertical, Vertical
from kickstand.errors import AlignmentError

STRAIGHT = (0.0, 0.0, 0.0)
UPRIGHT = (0.0, 1.0, 0.0)


def tilted(pitch_deg):
    return [0.0, math.cos(math.radians(pitch_deg)), math.sin(math.radians(pitch_deg))]


def told(problem):
    """Code and values of an AlignmentError; None of none."""
    return problem and (problem.code, *problem.values)


def quality(counted=5, lag_s=0.5, car=True, vertical_problem=None):
    """A DrivingQuality whose drive has had so many events, none of which was off."""
    last = types.SimpleNamespace(forward=lambda out, level: 0.0)
    events = types.SimpleNamespace(counted=counted, lag_s=lag_s, last=last)
    vertical = types.SimpleNamespace(is_car=car, problem=lambda level: vertical_problem)
    judged = DrivingQuality(events, vertical)
    judged.quality_deg = judged.halves_deg = 1.0
    return judged


def decided(judged, quality_deg=1.0, halves_deg=1.0, forward_deg=1.0, sigmas=1.0, force_ratio=1.0, level_deg=1.0):
    judged.quality_deg, judged.halves_deg = quality_deg, halves_deg
    judged.parts.forward_deg, judged.parts.sigmas = forward_deg, sigmas
    judged._decide(force_ratio, level_deg)
    return judged


def test_an_alignment_is_ready_at_one_and_a_half_degrees_and_stays_so_up_to_two_and_a_half():
    judged = quality()
    assert not decided(judged, quality_deg=1.51).good
    assert decided(judged, quality_deg=1.49).good
    assert decided(judged, quality_deg=2.49).good
    assert not decided(judged, quality_deg=2.51).good
    assert not decided(judged, quality_deg=2.0).good


def test_five_events_make_an_alignment():
    assert decided(quality(counted=5)).good
    assert not decided(quality(counted=4)).good


def test_halves_agree_within_four_degrees_and_stay_so_up_to_six():
    judged = quality()
    assert not decided(judged, halves_deg=4.1).agree
    assert decided(judged, halves_deg=3.9).agree
    assert decided(judged, halves_deg=5.9).agree
    assert not decided(judged, halves_deg=6.1).good


def test_parts_agree_within_four_degrees_or_three_sigmas():
    judged = quality()
    assert not decided(judged, forward_deg=4.1, sigmas=3.1).agree
    assert decided(judged, forward_deg=3.9, sigmas=9.0).agree
    assert decided(judged, forward_deg=5.9, sigmas=9.0).agree
    assert not decided(judged, forward_deg=6.1, sigmas=4.1).agree
    assert decided(judged, forward_deg=20.0, sigmas=2.9).agree
    assert decided(judged, forward_deg=20.0, sigmas=3.9).agree
    assert not decided(judged, forward_deg=20.0, sigmas=4.1).agree


def mount_words(judged):
    return judged.mount_problem and judged.mount_problem.values[0]


def test_what_a_mount_that_moved_looks_like():
    for level_deg, words in ((7.9, None), (8.1, "vertical")):
        assert mount_words(decided(quality(), level_deg=level_deg)) == words
    for forward_deg, sigmas, words in ((29.0, 9.0, None), (31.0, 3.9, None), (31.0, 4.1, "forward")):
        assert mount_words(decided(quality(), forward_deg=forward_deg, sigmas=sigmas)) == words
    for car in (True, False):
        for name in ("roll_deg", "pitch_deg"):
            for degrees, words in ((6.9, None), (7.1, "parts" if car else None)):
                judged = quality(car=car)
                setattr(judged.parts, name, degrees)
                assert mount_words(decided(judged)) == words
    problem = AlignmentError("mount-moved", "since-standing", 9.0)
    assert decided(quality(vertical_problem=problem)).mount_problem is problem
    assert decided(quality(counted=4), level_deg=30.0).mount_problem is None  # too early to tell


@pytest.mark.parametrize(
    ("weight", "angle_deg", "size", "off"),
    [(0.013, 81.0, 0.51, True), (0.011, 81.0, 0.51, False), (0.013, 79.0, 0.51, False), (0.013, 81.0, 0.49, False)],
)
def test_an_event_80_degrees_off_shows_that_the_mount_moved(weight, angle_deg, size, off):
    def forward(out, level):
        out[0] = size * math.sin(math.radians(angle_deg))
        out[1], out[2] = 0.0, size * math.cos(math.radians(angle_deg))
        return weight

    judged = quality()
    judged.fit.forward[2] = 1.0
    judged._events.last = types.SimpleNamespace(forward=forward)
    assert (mount_words(decided(judged)) == "forward") is off


def test_the_speed_is_judged_from_two_events_on():
    assert decided(quality(counted=1), force_ratio=3.0).speed_problem is None
    assert told(decided(quality(counted=2), force_ratio=3.0).speed_problem) == ("speed-unit", pytest.approx(1 / 3))


@pytest.mark.parametrize(
    ("lag_s", "ratio", "code"),
    [
        (1.89, 1.0, None),
        (1.9, 1.0, "speed-late"),
        (0.0, 0.76, None),
        (0.0, 0.74, "speed-unit"),
        (0.0, 1.34, None),
        (0.0, 1.36, "speed-unit"),
        (0.0, 0.0, "speed-unit"),
    ],
)
def test_a_speed_may_be_1_9_s_late_and_a_third_wrong(lag_s, ratio, code):
    problem = fit_problem(lag_s, ratio)
    assert (problem and problem.code) == code


def test_a_wrong_unit_is_told_as_what_the_speed_is_multiplied_by():
    assert told(fit_problem(0.0, 0.25)) == ("speed-unit", 4.0)
    assert told(fit_problem(0.0, -1.0)) == ("speed-unit", 99.9)


@pytest.mark.parametrize(("speed", "bad"), [(0.0, False), (-0.49, False), (-0.51, True)])
def test_half_a_metre_a_second_below_zero_is_noise(speed, bad):
    check = SpeedCheck()
    check.measure(speed)
    assert (check.problem is not None) is bad


def stuck_after(seconds, change_g=0.1, yaw_dps=0.0, calm=0):
    check = SpeedCheck()
    check.measure(7.0)
    for _ in range(calm):
        check.update_second([0.0, 1.0, 0.0])
    for k in range(seconds):
        check.measure(7.0)
        check.update_second([0.0, 1.0, change_g * (k % 2)], yaw_dps)
    return check.problem is not None


def test_a_speed_is_stuck_after_eight_lively_seconds():
    """The first one has none before it. Lively are 30 mg; seconds over 5 deg/s are left out."""
    assert not stuck_after(8)
    assert stuck_after(9)
    assert stuck_after(20, change_g=0.031)
    assert not stuck_after(20, change_g=0.029)
    assert stuck_after(20, yaw_dps=4.9)
    assert not stuck_after(20, yaw_dps=5.1)
    # eight of 53 seconds are 15 %
    assert stuck_after(9, calm=45)
    assert not stuck_after(9, calm=46)


def test_a_change_of_speed_begins_the_count_again():
    check = SpeedCheck()
    for k in range(15):
        check.measure(7.0 if k < 8 else 7.1)
        check.update_second([0.0, 1.0, 0.1 * (k % 2)])
    assert check.problem is None


def test_seconds_are_made_of_shorter_means():
    check = SpeedCheck()
    check.measure(7.0)
    for k in range(95):
        check.update([0.0, 1.0, 0.1 * (k // 10 % 2)], 0.0, 100_000)
    assert check.problem is not None
    check = SpeedCheck()
    check.measure(7.0)
    for k in range(95):
        check.update([0.0, 1.0, 0.1 * (k // 10 % 2)], 6.0 * (-1) ** k, 100_000)
    assert check.problem is None


def events(accelerations, seconds=0.5):
    """The change of speed (m/s) of each event that ended."""
    finder, found = EventFinder(1), []
    for acceleration in (*accelerations, 0.0):
        if finder.update(acceleration * seconds, seconds, [True]):
            found.append(finder.change)
    return found


def test_an_event_begins_at_0_8_and_ends_at_0_4_mps2_and_changes_the_speed_by_1_5_mps():
    for sign in (1.0, -1.0):
        assert events([sign * 0.81] * 4) == [pytest.approx(sign * 1.62)]
        assert events([sign * 0.79] * 10) == []
        assert events([sign * 1.0] + [sign * 0.41] * 10) == [pytest.approx(sign * 2.55)]
        assert events([sign * 1.0] * 2 + [sign * 0.39] * 10) == []
        assert events([sign * 1.01] * 3) == [pytest.approx(sign * 1.515)]
        assert events([sign * 0.99] * 3) == []
    assert events([-2.0] * 3 + [0.0] + [2.0] * 3) == [pytest.approx(-3.0), pytest.approx(3.0)]


def test_only_two_acceleration_events_count():
    found = DrivingEvents(ForceHistory())
    for braking, acceleration, counted in ((0, 1, 1), (0, 2, 2), (0, 5, 2), (3, 5, 5)):
        found.braking_count, found.acceleration_count = braking, acceleration
        assert found.counted == counted
        assert found.straight_count == braking + acceleration


def test_the_last_event_shows_forward():
    """Braking by 0.3 and 0.5 g for half a second each: force is the vertical and so much to the back."""
    last = LastEvent()
    last.add(0.5, 99.0, [1.0, 1.0, 1.0])
    last.clear()
    for a in (-0.3, -0.5):
        last.add(0.5, 0.5 * a, [0.5 * 0.8 * a, 0.5, 0.5 * 0.6 * a])
    out = [0.0] * 3
    assert last.forward(out, [0.0, 1.0, 0.0]) == pytest.approx(0.5 * (0.3**2 + 0.5**2))
    assert out == pytest.approx([0.8, 0.0, 0.6])


def stops_of(seconds, speed=0.0):
    standing = StandingVertical()
    for _ in range(round(seconds * 10)):
        standing.update(list(UPRIGHT), [0.0] * 3, speed, 0.1)
    return standing.stops


def test_a_stop_settles_for_one_second_and_lasts_two_more():
    assert stops_of(2.8) == 0
    assert stops_of(3.2) == 1
    assert stops_of(30.0) == 1
    assert stops_of(10.0, speed=0.5) == 1
    assert stops_of(10.0, speed=0.51) == 0


def still(first, then):
    """Whether a stop goes on as force and rate change from one to the other at once."""
    standing = StandingVertical()
    for _ in range(50):
        standing.update(list(first[0]), list(first[1]), 0.0, 0.1)
    assert standing.standing
    standing.update(list(then[0]), list(then[1]), 0.0, 0.1)
    return standing.standing


def test_60_mg_or_three_degrees_a_second_at_once_are_no_stop():
    at_rest = (UPRIGHT, STRAIGHT)
    for axis in range(3):
        for change, stands in ((0.059, True), (0.061, False), (-0.061, False)):
            force = [UPRIGHT[i] + change * (i == axis) for i in range(3)]
            assert still(at_rest, (force, STRAIGHT)) is stands
        for change, stands in ((2.9, True), (3.1, False), (-3.1, False)):
            assert still(at_rest, (UPRIGHT, [change * (i == axis) for i in range(3)])) is stands


def two_stops(pitch_deg, speed=5.0, rate=STRAIGHT):
    standing = StandingVertical()
    for force, seconds, mps in ((UPRIGHT, 5.0, 0.0), (UPRIGHT, 2.0, speed), (tilted(pitch_deg), 12.0, 0.0)):
        for _ in range(round(seconds * 10)):
            standing.update(list(force), list(rate) if force is not UPRIGHT else [0.0] * 3, mps, 0.1)
    return standing


def test_stops_eight_degrees_apart_are_a_mount_that_moved():
    assert not two_stops(7.9).moved
    assert two_stops(8.1).moved
    assert two_stops(4.0).stops == 2
    assert two_stops(4.0).up[2] == pytest.approx(math.sin(math.radians(2.0)), abs=1e-4)


def test_a_stop_is_another_one_after_2_mps():
    assert two_stops(1.0, speed=2.1).stops == 2
    assert two_stops(1.0, speed=1.9).stops == 1


def test_a_rate_ten_degrees_a_second_off_the_bias_is_a_turn():
    assert two_stops(1.0, rate=(0.0, 9.9, 0.0)).stops == 2
    assert two_stops(1.0, rate=(0.0, 10.1, 0.0)).stops == 1


def turned(pitch_deg, seconds):
    """The sensor is turned while the vehicle stands."""
    standing = StandingVertical()
    for force, lasts in ((UPRIGHT, 5.0), (tilted(pitch_deg), seconds)):
        for _ in range(round(lasts * 10)):
            standing.update(list(force), [0.0] * 3, 0.0, 0.1)
    return standing


def test_what_is_turned_at_a_stop_for_six_seconds_has_moved():
    assert turned(1.4, 10.0).standing
    assert not turned(2.2, 10.0).standing
    assert not turned(7.9, 20.0).moved
    assert not turned(15.0, 6.0).moved
    assert turned(15.0, 7.5).moved


@pytest.mark.parametrize(("car", "words"), [(True, "since-standing"), (False, "since-upright")])
def test_straight_driving_has_to_be_within_eight_degrees_of_before(car, words):
    standing = types.SimpleNamespace(stops=1, up=list(UPRIGHT))
    vertical = Vertical(car, None if car else list(UPRIGHT), standing)
    assert vertical.problem(tilted(7.9)) is None
    assert told(vertical.problem(tilted(8.1))) == ("mount-moved", words, pytest.approx(8.1, abs=0.01))
    assert Vertical(False, None, standing).problem(tilted(30.0)) is None


def test_where_the_vertical_comes_from():
    standing = types.SimpleNamespace(stops=0, up=tilted(10.0))
    fit = types.SimpleNamespace(level=[2.0 * part for part in tilted(4.0)])

    def pitch(vertical, fit=None):
        out = [0.0] * 3
        return round(math.degrees(math.atan2(out[2], out[1])), 3) if vertical.known(out, fit) else None

    car, bike, posed = (
        Vertical(True, None, standing),
        Vertical(False, None, standing),
        Vertical(False, UPRIGHT, standing),
    )
    assert (pitch(car), pitch(bike), pitch(posed)) == (None, None, 0.0)
    assert (pitch(car, fit), pitch(bike, fit), pitch(posed, fit)) == (None, 4.0, 0.0)
    standing.stops = 1
    assert (pitch(car), pitch(car, fit)) == (10.0, 7.0)
    bike.update(tilted(0.0), 10.0)
    bike.update(tilted(8.0), 10.0)
    assert pitch(bike) == pytest.approx(4.0, abs=0.1)  # the mean
    assert bike.turn_axis == pytest.approx([0.0, *tilted(4.0)[1:]], abs=0.01)
    assert posed.turn_axis == pytest.approx(UPRIGHT)
    assert car.turn_axis is standing.up
    for _ in range(60):
        bike.update(tilted(8.0), 10.0)
    assert pitch(bike) == pytest.approx(8.0, abs=0.1)  # of the last minute


def driven(yaw_deg=0.0, level_deg=0.0, counted=5, straight=5, ready=True, quality_deg=0.5, blocks=(0.0,), speed=None):
    """What compare() asks of a drive whose forward is so far to the left of forward."""

    def direction(degrees):
        return [math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))]

    def fit(part, lag, first, last):
        part.forward[:] = direction(yaw_deg + blocks[first])
        return True

    regression = types.SimpleNamespace(filled=len(blocks), fit=fit)
    found = types.SimpleNamespace(forward=direction(yaw_deg), level=tilted(level_deg))
    return types.SimpleNamespace(
        events=types.SimpleNamespace(straight_count=straight, regression=regression, lag=0),
        quality=types.SimpleNamespace(fit=found, quality_deg=quality_deg, speed_problem=speed),
        counted=counted,
        needed=5,
        ready=ready,
    )


MATRIX = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        ({"yaw_deg": 0.9}, verdict.SAME),
        ({"yaw_deg": 1.1}, verdict.REFINED),
        ({"yaw_deg": 1.1, "quality_deg": 1.2}, verdict.SAME),
        ({"yaw_deg": 29.0}, verdict.REFINED),
        ({"yaw_deg": 31.0}, verdict.MOVED),
        ({"yaw_deg": 134.0}, verdict.MOVED),
        ({"yaw_deg": 136.0}, verdict.REVERSED),
        ({"yaw_deg": 180.0, "counted": 2, "straight": 2, "ready": False}, verdict.REVERSED),
        ({"yaw_deg": 180.0, "counted": 1, "straight": 1, "ready": False}, verdict.UNKNOWN),
        ({"yaw_deg": 180.0, "speed": "wrong"}, verdict.UNKNOWN),
        ({"yaw_deg": 140.0, "blocks": (0.0, -51.0)}, verdict.MOVED),
        ({"yaw_deg": 140.0, "blocks": (0.0, -49.0)}, verdict.REVERSED),
        ({"level_deg": 7.9}, verdict.SAME),
        ({"level_deg": 8.1}, verdict.MOVED),
        ({"level_deg": 8.1, "counted": 4}, verdict.UNKNOWN),
        ({"yaw_deg": 31.0, "ready": False}, verdict.UNKNOWN),
    ],
)
def test_what_a_drive_says_of_an_alignment_from_before(drive, expected, sign):
    drive = dict(drive, yaw_deg=sign * drive.get("yaw_deg", 0.0))
    if "blocks" in drive:
        drive["blocks"] = tuple(sign * off for off in drive["blocks"])
    assert verdict.compare(driven(**drive), MATRIX) == expected


def test_a_yaw_error_to_the_left_is_positive():
    fit = types.SimpleNamespace(forward=[0.5, 0.0, math.sqrt(0.75)])
    assert verdict.yaw_deg(fit, MATRIX) == pytest.approx(30.0)


def test_the_state_tells_what_is_waited_for():
    drive = DriveAlignment("car")
    assert drive.state == WAITING_FOR_SPEED
    drive.measure_speed(0.0)
    assert drive.state == WAITING_FOR_STOP
    for _ in range(40):
        drive.update(UPRIGHT, STRAIGHT, 100_000)
    assert drive.state == WAITING_FOR_BRAKING
    for _ in range(9):
        drive.update(UPRIGHT, STRAIGHT, 100_000)
    drive.measure_speed(0.0)
    for _ in range(50):
        drive.update(UPRIGHT, STRAIGHT, 100_000)
    assert drive.state == WAITING_FOR_BRAKING  # five seconds without a speed may be
    drive.update(UPRIGHT, STRAIGHT, 100_000)
    assert drive.state == WAITING_FOR_SPEED
    drive.measure_speed(5.0)
    drive.events._finder.going_on, drive.events._finder.change = True, -1.0
    drive.events._straight[drive.events.lag] = True
    assert drive.state == BRAKING
    drive.events._straight[drive.events.lag] = False
    assert drive.state == TURNING
    drive.quality.good = True
    assert drive.state == READY
    assert drive.ready
    drive.measure_speed(-5.0)
    assert drive.state == REFUSED
    assert not drive.ready
    with pytest.raises(AlignmentError):
        drive.matrix([0.0] * 9)


def test_what_is_missing_is_told_in_the_order_of_the_way():
    drive = DriveAlignment("car")
    codes = []

    def missing(*counts):
        codes.append(drive.missing(*counts).code)

    missing(0, 5, 0)
    drive.measure_speed(1.9)
    missing(0, 5, 0)
    drive.measure_speed(2.0)
    missing(0, 5, 0)
    drive.standing.stops = 1
    missing(4, 5, 1)
    missing(5, 5, 1)
    drive.quality.quality_deg = 3.0
    missing(5, 5, 1)
    drive.quality.agree = True
    missing(5, 5, 1)
    assert codes == ["no-speed", "not-driven", "not-stopped", "few-events", "uncertain", "parts-differ", "uncertain"]
    assert DriveAlignment("motorcycle").missing(0, 5, 0).code == "no-speed"
    bike = DriveAlignment("motorcycle")
    bike.measure_speed(9.0)
    assert bike.missing(4, 5, 1).values == (4, 5, 1)
