"""ViriCiti's method against numbers computed by hand from the article, "Aligning the coordinate systems of
accelerometer and vehicle" (S. Liem and E. Poeze): R = I + sin t (u.L) + (1 - cos t) (u.L)^2, u the direction of a x b,
t the angle between a and b. The article has z down and x forward; here the axes are left, up, forward, so the reading
of gravity is (0, 1, 0) and that of braking (0, 0, -1)."""

from array import array

import numpy as np
import pytest
from kickstand.errors import AlignmentError
from kickstand.units import GAP_US
from kickstand_tools.calibration.published import (
    BACKWARD,
    UP,
    PublishedAlignment,
    circular_dispersion,
    rotation_between,
)

# By hand, for a = (2, 1, 2) / 3 and b = up: a x b = (-2, 0, 2) / 3 and cos t = 1 / 3. With K = (a x b).L
#   K = [[0, -2, 0], [2, 0, 2], [0, -2, 0]] / 3,  K^2 = [[-4, 0, -4], [0, -8, 0], [-4, 0, -4]] / 9
# and (1 - cos t) / sin^2 t = 1 / (1 + cos t) = 3 / 4, so R = I + K + 3/4 K^2:
LEVEL = np.array([[2, -2, -1], [2, 1, 2], [-1, -2, 2]]) / 3
# For a = (0.6, 0, -0.8) and b = backward: a x b = (0, 0.6, 0), u.L = L_y, sin t = 0.6, cos t = 0.8, L_y^2 =
# diag(-1, 0, -1), so R = I + 0.6 L_y + 0.2 L_y^2:
TURN = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
# The matrix product TURN @ LEVEL, by hand: a sensor that reads (2, 1, 2) / 3 at rest, and whose levelled reading of
# braking is along (0.6, 0, -0.8)
MOUNT = np.array([[1.0, -2.8, 0.4], [2, 1, 2], [-2.0, -0.4, 2.2]]) / 3
# The same with braking along (0.6, 0, 0.8), over 90 degrees from backward: about up sin t = 0.6, cos t = -0.8, so the
# turn is [[-0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, -0.8]]
TURNED_MOUNT = np.array([[-2.2, 0.4, 2.0], [2, 1, 2], [-0.4, 2.8, -1.0]]) / 3
BRAKES = (0.0, 1.0, -0.3)  # g, along left, up, forward
STEADY = (0.0, 1.0, 0.0)
G = 9.80665


@pytest.mark.parametrize(
    ("a", "b", "axis", "by_hand"),
    [
        # a x b = (0, 0, 0.6), u.L = L_z, sin t = 0.6, cos t = 0.8
        ((0.6, 0.8, 0.0), UP, 0, [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]),
        ((2 / 3, 1 / 3, 2 / 3), UP, 0, LEVEL),
        ((0.6, 0.0, -0.8), BACKWARD, 1, TURN),
        # over 90 degrees: about the third axis sin t = 0.6, cos t = -0.8 as in the article
        ((0.6, -0.8, 0.0), UP, 2, [[-0.8, -0.6, 0], [0.6, -0.8, 0], [0, 0, 1]]),
        # after half a turn about the first axis, (0.6, 0.8, 0): the first line times diag(1, -1, -1)
        ((0.6, -0.8, 0.0), UP, 0, [[0.8, 0.6, 0], [0.6, -0.8, 0], [0, 0, -1]]),
    ],
)
def test_the_rotation_is_the_articles(a, b, axis, by_hand):
    assert rotation_between(np.array(a), b, axis) == pytest.approx(np.array(by_hand), abs=1e-12)


@pytest.mark.parametrize("turned", [1.0, 1j, 0.6 - 0.8j])
def test_the_dispersion_by_hand(turned):
    """Directions at 0 and at the angles of cosine 0.8 to both sides: R = 2.6 / 3, and cos 2a = 2 x 0.64 - 1 = 0.28, so
    rho2 = 1.56 / 3 = 0.52 and d = 0.48 / (2 x 6.76 / 9) = 4.32 / 13.52. Two directions at a to both sides: R = cos a,
    rho2 = cos 2a, d = tan^2 a; of tangent 3 / 4 that is 9 / 16."""
    three, two = [0.8 + 0.6j, 1.0, 0.8 - 0.6j], [0.8 + 0.6j, 0.8 - 0.6j]
    assert circular_dispersion([turned * way for way in three]) == pytest.approx(4.32 / 13.52, rel=1e-9)
    assert circular_dispersion([turned * way for way in two]) == pytest.approx(9 / 16, rel=1e-9)
    assert circular_dispersion([turned]) == pytest.approx(0.0, abs=1e-12)


def test_directions_without_a_mean_have_the_largest_dispersion():
    """Two directions, each off by an angle whose tangent is 4, would give d = 16. Opposite directions give R = 0."""
    wide = (1 + 4j) / 17**0.5
    assert circular_dispersion([wide, wide.conjugate()]) == 9.9
    assert circular_dispersion([1.0, -1.0]) == 9.9
    # tangent 3: d = 9 is not limited
    far = (1 + 3j) / 10**0.5
    assert circular_dispersion([far, far.conjugate()]) == pytest.approx(9.0, rel=1e-9)


class Drive:
    """A drive with a sample every 10 ms and a speed every every_s."""

    def __init__(self, every_s=0.5, mount=MOUNT):
        self.alignment, self.mount = PublishedAlignment("car"), mount
        self.speed, self.every = 0.0, round(100 * every_s)
        self.go(STEADY, 6.0)

    def go(self, forces, seconds, mps2=0.0):
        """Drive with each of the forces for an equal share of the time."""
        readings = (
            np.atleast_2d(forces) @ self.mount
        ).tolist()  # the transposed matrix: from the vehicle's axes to the sensor's
        samples = round(100 * seconds)
        for k in range(samples):
            self.speed += 0.01 * mps2
            self.alignment.update(readings[k * len(readings) // samples], (0.0, 0.0, 0.0), 10_000)
            if (k + 1) % self.every == 0:
                self.alignment.measure_speed(self.speed)

    def brake(self, *forces, seconds=2.0, mps2=-0.3 * G):
        """The braking starts at 15 m/s, then the speed stays constant."""
        self.reach_15_mps()
        self.go(forces or BRAKES, seconds, mps2)
        self.go(STEADY, 2.0)

    def reach_15_mps(self):
        self.go((0.0, 1.0, 0.3), (15.0 - self.speed) / (0.3 * G), 0.3 * G)
        self.go(STEADY, 2.0)

    @property
    def matrix(self):
        out = array("f", [0.0] * 9)
        self.alignment.matrix(out)
        return np.array(out).reshape(3, 3)


@pytest.mark.parametrize(
    ("every_s", "mount"), [(0.1, MOUNT), (0.5, MOUNT), (1.0, MOUNT), (2.0, MOUNT), (0.5, TURNED_MOUNT)]
)
def test_stops_and_three_brakings_give_the_mount_by_hand(every_s, mount):
    drive = Drive(every_s, mount)
    for counted in range(3):
        assert drive.alignment.counted == counted and not drive.alignment.ready
        drive.brake(seconds=4.0)
    assert drive.alignment.ready and drive.alignment.turned == 0
    assert drive.matrix == pytest.approx(mount, abs=1e-6)


def test_forward_is_along_the_sum_of_the_brakings_forces():
    """Level forces (0.3 x 0.6, -0.3 x 0.8) for 2 s, (0, -0.3) for 2 s, (-0.3 x 0.6, -0.3 x 0.8) for 2 s: their sum is
    straight back. Their directions are those of the dispersion by hand, so the standard error of their mean is the
    root of 4.32 / 13.52 / 3, in degrees 18.70."""
    drive = Drive()
    assert drive.alignment.quality_deg == 180.0
    drive.brake((0.18, 1.0, -0.24), mps2=-0.24 * G)
    assert drive.alignment.quality_deg == 180.0
    drive.brake()
    drive.brake((-0.18, 1.0, -0.24), mps2=-0.24 * G)
    assert drive.alignment.counted == 3
    assert drive.alignment.quality_deg == pytest.approx(18.70, abs=0.005)
    assert drive.matrix == pytest.approx(MOUNT, abs=1e-6)


def test_a_longer_braking_counts_for_more():
    """Force times 10 means of 100 ms for each second: (0.18, -0.24) for 4 s and (0, -0.3) twice for 2 s make
    40 x 0.18 = 7.2 to the left and 40 x 0.24 + 2 x 20 x 0.3 = 21.6 back. So the mean points to the left of
    backward by atan(1 / 3)."""
    drive = Drive()
    drive.brake((0.18, 1.0, -0.24), seconds=4.0, mps2=-0.24 * G)
    drive.brake()
    drive.brake()
    seen = MOUNT.T @ [1 / 10**0.5, 0.0, -3 / 10**0.5]
    assert drive.matrix @ seen == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
    assert drive.matrix[1] == pytest.approx(MOUNT[1], abs=1e-6)


@pytest.mark.parametrize(("side_g", "counted"), [(0.040, 1), (0.045, 0)])
def test_a_braking_whose_direction_spreads_does_not_count(side_g, counted):
    """Half of the braking pulls to the left and half to the right, by side_g of 0.3 g. d = (side_g / 0.3)^2 is
    0.0178 and 0.0225, and the limit is 0.02."""
    drive = Drive()
    drive.brake((side_g, 1.0, -0.3), (-side_g, 1.0, -0.3))
    assert (drive.alignment.counted, drive.alignment.turned) == (counted, 1 - counted)


def test_a_shaking_of_ten_times_a_second_is_averaged_away():
    """Every 50 ms the force changes sides by 0.2 g. Over 100 ms the mean is 0, but over 50 ms the dispersion would
    be (0.2 / 0.3)^2 = 0.44."""
    drive = Drive()
    drive.brake(*[(side, 1.0, -0.3) for side in (0.2, -0.2)] * 20)
    assert (drive.alignment.counted, drive.alignment.turned) == (1, 0)


@pytest.mark.parametrize(
    ("seconds", "mps2", "counted"),
    [
        (2.0, -0.74, 0),  # below 1 m/s2 it is not a braking, for any force
        (2.0, -0.99, 0),
        (2.0, -1.01, 1),
        (1.0, -1.45, 0),  # less than 1.5 m/s in total
        (1.0, -1.55, 1),
        (0.5, -2.9, 0),
        (0.5, -3.1, 1),
        (2.0, 3.0, 0),
    ],
)
def test_which_change_of_speed_is_a_braking(seconds, mps2, counted):
    """A braking event that reduces the speed too little is noise. It is not counted as braking in a bend either."""
    drive = Drive()
    drive.brake(seconds=seconds, mps2=mps2)
    assert (drive.alignment.counted, drive.alignment.turned) == (counted, 0)


@pytest.mark.parametrize(("level_g", "counted"), [(0.029, 0), (0.031, 1)])
def test_a_small_level_force_has_no_direction(level_g, counted):
    drive = Drive()
    drive.brake((0.6 * level_g, 1.0, -0.8 * level_g))
    assert drive.alignment.counted == counted


def test_a_small_braking_adds_nothing_to_the_next_one():
    drive = Drive()
    drive.brake(seconds=0.5, mps2=-2.0)
    drive.brake(seconds=0.5, mps2=-2.0)
    assert drive.alignment.counted == 0


def lost_samples(drive):
    drive.alignment.update((0.0, 1.0, 0.0), (0.0, 0.0, 0.0), GAP_US + 1)


def lost_speeds(drive):
    for _ in range(230):
        drive.alignment.update((np.array(BRAKES) @ MOUNT).tolist(), (0.0, 0.0, 0.0), 10_000)


@pytest.mark.parametrize("lost", [lost_samples, lost_speeds])
def test_a_braking_with_a_gap_is_dropped_and_earlier_ones_stay(lost):
    drive = Drive()
    drive.brake()
    drive.reach_15_mps()
    drive.go(BRAKES, 2.0, -0.3 * G)
    lost(drive)
    drive.go(STEADY, 3.0)
    assert (drive.alignment.counted, drive.alignment.turned) == (1, 0)
    drive.brake()
    assert drive.alignment.counted == 2


@pytest.mark.parametrize("lost", [lost_samples, lost_speeds])
def test_the_loss_of_a_dropped_braking_is_dropped_too(lost):
    """The braking loses 3 m/s before the gap and 0.5 s x 2 m/s2 = 1 m/s after it. This is less than the 1.5 m/s that
    a braking event needs."""
    drive = Drive()
    drive.reach_15_mps()
    drive.go(BRAKES, 1.0, -3.0)
    lost(drive)
    drive.go(STEADY, 1.0)
    drive.go(BRAKES, 0.5, -2.0)
    drive.go(STEADY, 1.0)
    assert (drive.alignment.counted, drive.alignment.turned) == (0, 0)


def test_brakings_before_the_first_stop_show_no_direction():
    drive = Drive()
    drive.alignment = PublishedAlignment("car")
    drive.brake()
    assert drive.alignment.counted == 0
    with pytest.raises(AlignmentError, match="not-stopped"):
        drive.matrix  # noqa: B018


def test_too_few_brakings_are_refused_with_their_numbers():
    drive = Drive()
    drive.brake()
    drive.brake((0.1, 1.0, -0.3), (-0.1, 1.0, -0.3))
    reason = drive.alignment.reason
    assert (reason.code, *reason.values) == ("few-events", 1, 3, 1)
    with pytest.raises(AlignmentError, match="few-events"):
        drive.matrix  # noqa: B018
