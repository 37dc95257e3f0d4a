"""ViriCiti's published method is compared with numbers computed by hand from its article, "Aligning the coordinate
systems of accelerometer and vehicle" (S. Liem and E. Poeze).

The article rotates a unit vector a to a unit vector b with this matrix:

    R = I + sin t (u.L) + (1 - cos t) (u.L)^2

    u: the direction of a x b
    t: the angle between a and b
    u.L: the cross product matrix of u; L_x, L_y and L_z are those of the three axes

In the article z points down and x forward. The tests use the axes left, up, forward. A vehicle at rest therefore reads
(0, 1, 0), and the force of braking is along (0, 0, -1).
"""

from array import array

import numpy as np
import pytest
from kickstand.errors import Refusal
from kickstand_tools.calibration.published import (
    BACKWARD,
    UP,
    PublishedAlignment,
    circular_dispersion,
    rotation_between,
)

# The rotation that takes a = (2, 1, 2) / 3 to b = up, computed by hand:
#   a x b = (-2, 0, 2) / 3
#   cos t = 1 / 3
#   K = (a x b).L = [[0, -2, 0], [2, 0, 2], [0, -2, 0]] / 3
#   K^2 = [[-4, 0, -4], [0, -8, 0], [-4, 0, -4]] / 9
#   (1 - cos t) / sin^2 t = 1 / (1 + cos t) = 3 / 4
#   R = I + K + 3/4 K^2
LEVEL = np.array([[2, -2, -1], [2, 1, 2], [-1, -2, 2]]) / 3
# The rotation that takes a = (0.6, 0, -0.8) to b = backward, computed by hand:
#   a x b = (0, 0.6, 0), so u.L = L_y
#   sin t = 0.6, cos t = 0.8
#   L_y^2 = diag(-1, 0, -1)
#   R = I + 0.6 L_y + 0.2 L_y^2
TURN = np.array([[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]])
# The matrix product TURN @ LEVEL, computed by hand. The sensor in this case reads (2, 1, 2) / 3 at rest. LEVEL rotates
# its force of braking to (0.6, 0, -0.8).
MOUNT = np.array([[1.0, -2.8, 0.4], [2, 1, 2], [-2.0, -0.4, 2.2]]) / 3
# The second sensor also reads (2, 1, 2) / 3 at rest, but LEVEL rotates its force of braking to (0.6, 0, 0.8), which is
# over 90 degrees from backward. The rotation about up has sin t = 0.6 and cos t = -0.8, so it is [[-0.8, 0, 0.6], [0,
# 1, 0], [-0.6, 0, -0.8]].
TURNED_MOUNT = np.array([[-2.2, 0.4, 2.0], [2, 1, 2], [-0.4, 2.8, -1.0]]) / 3
BRAKES = (0.0, 1.0, -0.3)  # the force while braking, in g along left, up, forward
STEADY = (0.0, 1.0, 0.0)
G = 9.80665


@pytest.mark.parametrize(
    ("a", "b", "axis", "by_hand"),
    [
        # a x b = (0, 0, 0.6), u.L = L_z, sin t = 0.6, cos t = 0.8
        ((0.6, 0.8, 0.0), UP, 0, [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]),
        ((2 / 3, 1 / 3, 2 / 3), UP, 0, LEVEL),
        ((0.6, 0.0, -0.8), BACKWARD, 1, TURN),
        # The angle from a to b is over 90 degrees. As in the article, the rotation about the third axis has sin t = 0.6
        # and cos t = -0.8.
        ((0.6, -0.8, 0.0), UP, 2, [[-0.8, -0.6, 0], [0.6, -0.8, 0], [0, 0, 1]]),
        # a half turn about the first axis takes a to (0.6, 0.8, 0), so the result is the first case's matrix times
        # diag(1, -1, -1)
        ((0.6, -0.8, 0.0), UP, 0, [[0.8, 0.6, 0], [0.6, -0.8, 0], [0, 0, -1]]),
    ],
)
def test_the_rotation_is_the_articles(a, b, axis, by_hand):
    assert rotation_between(np.array(a), b, axis) == pytest.approx(np.array(by_hand), abs=1e-12)


@pytest.mark.parametrize("off_deg", [0.0, 0.01, 45.0, 89.9, 90.1, 179.99, 180.0])
def test_the_rotation_is_safe_at_every_angle(off_deg):
    """The result is a rotation from a to b within 1e-12, even if a and b are exactly antiparallel."""
    rng, off = np.random.default_rng(3), np.radians(off_deg)
    for axis, b in ((0, UP), (2, UP), (1, BACKWARD)):
        for turn in rng.uniform(0, 2 * np.pi, 6):
            side = np.zeros(3)
            side[b == 0.0] = np.cos(turn), np.sin(turn)
            a = np.cos(off) * b + np.sin(off) * side
            r = rotation_between(a, b, axis)
            assert np.abs(r @ r.T - np.eye(3)).max() < 1e-12 and np.linalg.det(r) > 0.99
            assert np.abs(r @ a - b).max() < 1e-12


@pytest.mark.parametrize("turned", [1.0, 1j, 0.6 - 0.8j])
def test_the_dispersion_by_hand(turned):
    """The dispersion is d = (1 - rho2) / (2 R^2), where R is the length of the mean direction, and rho2 is the mean
    cosine of twice the angle from the mean direction.

    Three directions, at -a, 0 and a, with cos a = 0.8:
        R = 2.6 / 3
        cos 2a = 2 x 0.64 - 1 = 0.28
        rho2 = 1.56 / 3 = 0.52
        d = 0.48 / (2 x 6.76 / 9) = 4.32 / 13.52

    Two directions, at -a and a, with tan a = 3 / 4:
        R = cos a
        rho2 = cos 2a
        d = tan^2 a = 9 / 16
    """
    three, two = [0.8 + 0.6j, 1.0, 0.8 - 0.6j], [0.8 + 0.6j, 0.8 - 0.6j]
    assert circular_dispersion([turned * direction for direction in three]) == pytest.approx(4.32 / 13.52, rel=1e-9)
    assert circular_dispersion([turned * direction for direction in two]) == pytest.approx(9 / 16, rel=1e-9)
    assert circular_dispersion([turned]) == pytest.approx(0.0, abs=1e-12)


class Drive:
    """A drive with a sample every 10 ms and a speed every `every_s` seconds. The drive begins with 6 s at rest."""

    def __init__(self, every_s=0.5, mount=MOUNT):
        self.alignment, self.mount = PublishedAlignment("car"), mount
        self.speed, self.every = 0.0, round(100 * every_s)
        self.go(STEADY, 6.0)

    def go(self, forces, seconds, mps2=0.0):
        """Drive for `seconds` with the acceleration mps2. The time is divided equally among the forces."""
        # the product with the transposed matrix rotates from the vehicle's axes to the sensor's
        readings = (np.atleast_2d(forces) @ self.mount).tolist()
        samples = round(100 * seconds)
        for k in range(samples):
            self.speed += 0.01 * mps2
            self.alignment.update(readings[k * len(readings) // samples], (0.0, 0.0, 0.0), 10_000)
            if (k + 1) % self.every == 0:
                self.alignment.measure_speed(self.speed)

    def brake(self, *forces, seconds=2.0, mps2=-0.3 * G):
        """Speed up to 15 m/s, brake with these forces, and then keep the speed for 2 s."""
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


@pytest.mark.parametrize(("every_s", "mount"), [(0.1, MOUNT), (2.0, MOUNT), (0.5, TURNED_MOUNT)])
def test_stops_and_three_brakings_give_the_mount_by_hand(every_s, mount):
    drive = Drive(every_s, mount)
    for counted in range(3):
        assert drive.alignment.counted == counted and not drive.alignment.ready
        drive.brake(seconds=4.0)
    assert drive.alignment.ready and drive.alignment.turned == 0
    assert drive.matrix == pytest.approx(mount, abs=1e-6)


def test_forward_is_along_the_sum_of_the_brakings_forces():
    """Three braking events have the levelled forces (0.18, -0.24), (0, -0.3) and (-0.18, -0.24) g along left and
    forward. The sum of these forces points straight back. The dispersion of their directions is 4.32 / 13.52, see
    test_the_dispersion_by_hand(). The standard error of the mean direction is therefore the root of 4.32 / 13.52 / 3,
    which is 18.70 degrees."""
    drive = Drive()
    assert drive.alignment.quality_deg == 180.0
    drive.brake((0.18, 1.0, -0.24), mps2=-0.24 * G)
    assert drive.alignment.quality_deg == 180.0
    drive.brake()
    drive.brake((-0.18, 1.0, -0.24), mps2=-0.24 * G)
    assert drive.alignment.counted == 3
    assert drive.alignment.quality_deg == pytest.approx(18.70, abs=0.005)
    assert drive.matrix == pytest.approx(MOUNT, abs=1e-6)


BRAKINGS = [
    # (seconds, m/s2, forces, counted, turned)
    (2.0, -0.99, [BRAKES], 0, 0),  # a deceleration below 1 m/s2 is not braking, whatever the force is
    (2.0, -1.01, [BRAKES], 1, 0),
    (1.0, -1.45, [BRAKES], 0, 0),  # braking that reduces the speed by less than 1.5 m/s is noise
    (1.0, -1.55, [BRAKES], 1, 0),
    (0.5, -2.9, [BRAKES], 0, 0),
    (2.0, 3.0, [BRAKES], 0, 0),
    (2.0, -3.0, [(0.6 * 0.029, 1.0, -0.8 * 0.029)], 0, 0),  # a level force of under 0.03 g has no direction
    (2.0, -3.0, [(0.6 * 0.031, 1.0, -0.8 * 0.031)], 1, 0),
    # The dispersion of two directions at -a and a is tan^2 a: here 0.0178 and 0.0225. The limit is 0.02.
    (2.0, -3.0, [(0.040, 1.0, -0.3), (-0.040, 1.0, -0.3)], 1, 0),
    (2.0, -3.0, [(0.045, 1.0, -0.3), (-0.045, 1.0, -0.3)], 0, 1),
    # The side force changes its side every 50 ms, so its mean over 100 ms, which the method uses, is 0.
    (2.0, -3.0, [(0.2, 1.0, -0.3), (-0.2, 1.0, -0.3)] * 20, 1, 0),
]


@pytest.mark.parametrize(("seconds", "mps2", "forces", "counted", "turned"), BRAKINGS)
def test_which_braking_counts(seconds, mps2, forces, counted, turned):
    drive = Drive()
    drive.brake(*forces, seconds=seconds, mps2=mps2)
    assert (drive.alignment.counted, drive.alignment.turned) == (counted, turned)


def test_brakings_before_the_first_stop_do_not_count():
    drive = Drive()
    drive.alignment = PublishedAlignment("car")
    drive.brake()
    assert drive.alignment.counted == 0
    with pytest.raises(Refusal, match="not-stopped"):
        drive.matrix  # noqa: B018


def test_too_few_brakings_are_refused_with_their_numbers():
    drive = Drive()
    drive.brake()
    drive.brake((0.1, 1.0, -0.3), (-0.1, 1.0, -0.3))
    reason = drive.alignment.reason
    assert (reason.code, *reason.values) == ("few-events", 1, 3, 1)
    with pytest.raises(Refusal, match="few-events"):
        drive.matrix  # noqa: B018
