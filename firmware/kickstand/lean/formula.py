"""Computes lean from one reading of forces and yaw rate in the vehicle frame (A. Nicolae, section 5, signs corrected).

With lean t > 0 to the right, s the centripetal acceleration in g (> 0 in a left turn) and forces in g:
    A_up cos t + A_left sin t = 1        (22)
    A_left cos t - A_up sin t = s        (23, corrected)
    A_left^2 + A_up^2 = 1 + s^2          (24)
"""

from math import asin, atan2, degrees, sqrt

_TOO_SMALL = 0.01  # (0.1 g)^2. A smaller squared force has no direction, because it is nearly free fall


def static_lean_deg(force):
    """Return the lean of a standing bike in degrees, > 0 to the right. This lean is equation (21) with a sign, and is
    exact near upright.

    force: left, up, forward in g.
    """
    return degrees(atan2(force[0], force[1]))


def centripetal_g(left_g, up_g, yaw_rate):
    """Return s, the centripetal acceleration in g, by (26). The force gives the size of s. The yaw rate gives the sign
    of s, which is > 0 in a left turn. Without a yaw rate s is 0."""
    excess = left_g * left_g + up_g * up_g - 1.0
    if excess <= 0.0 or yaw_rate == 0.0:
        return 0.0
    return sqrt(excess) if yaw_rate > 0.0 else -sqrt(excess)


def formula_lean_deg(force, yaw_rate):
    """Return Nicolae's lean by (25) and (26), in degrees, > 0 to the right. In free fall (under 0.1 g) the lean is 0.

    force: left, up, forward in g. yaw_rate: in any unit, because only its sign counts.

    In bends this lean is right on average. Near upright this lean is noisy: 1 % of vibration causes an error of 8
    degrees, always to the side of the yaw rate.
    """
    left, up = force[0], force[1]
    square = left * left + up * up
    if square < _TOO_SMALL:
        return 0.0
    sine = (left - centripetal_g(left, up, yaw_rate) * up) / square
    return degrees(asin(max(-1.0, min(1.0, sine))))
