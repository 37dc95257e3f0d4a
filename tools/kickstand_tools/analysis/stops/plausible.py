"""Is a stop plausible whose speed was integrated, without a speed in the log?

Integrated from a standstill that was not one, speed and distance can come out as anything.
"""

MAX_SPEED_MPS = 250.0 / 3.6
MAX_SIDE_M, MAX_HEADING_DEG = 15.0, 30.0  # off a straight line: more is a bend, not a stop
# How far the integrated speed may be from 0 at the standstill before: OPEN_MPS, and OPEN_MPS2 for each second between.
# A degree of pitch makes 0.17 m/s2, and a gyro's drift adds to it: over more than TELLING_S the speed tells nothing.
OPEN_MPS, OPEN_MPS2, TELLING_S = 3.0, 0.7, 30.0


def closes(speed_mps: float, seconds: float) -> bool:
    """True if speed_mps, integrated back from a standstill to the one before, is as near to 0 as that time allows."""
    return seconds > TELLING_S or abs(speed_mps) < OPEN_MPS + OPEN_MPS2 * seconds


def plausible(initial_speed_mps: float, side_m: float, heading_deg: float) -> bool:
    """True for a stop that can be: from this speed, so far to the side, turned by so much."""
    return initial_speed_mps < MAX_SPEED_MPS and abs(side_m) < MAX_SIDE_M and abs(heading_deg) < MAX_HEADING_DEG
