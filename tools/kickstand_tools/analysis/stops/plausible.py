"""Can it be, what was integrated without a speed in the log? A standstill that was none gives any speed and way."""

MAX_SPEED_MPS = 250.0 / 3.6
MAX_SIDE_M, MAX_HEADING_DEG = 15.0, 30.0  # off a straight line: more than that is a bend, not a stop
# What may be left of the speed at the standstill before: a degree of pitch is 0.17 m/s2, and a gyro's drift adds to
# it until nothing is told
OPEN_MPS, OPEN_MPS2, TELLING_S = 3.0, 0.7, 30.0


def closes(speed_mps: float, seconds: float) -> bool:
    """The ride between two rests, so long: speed_mps, integrated back from one, should be none at the other."""
    return seconds > TELLING_S or abs(speed_mps) < OPEN_MPS + OPEN_MPS2 * seconds


def plausible(initial_speed_mps: float, side_m: float, heading_deg: float) -> bool:
    """A stop from this speed, so far to the side and turned by so much."""
    return initial_speed_mps < MAX_SPEED_MPS and abs(side_m) < MAX_SIDE_M and abs(heading_deg) < MAX_HEADING_DEG
