"""Sensor to vehicle from driving: the vertical from standing or straight driving, forward from straight braking (ViriCiti).

    drive = DriveAlignment("car")                  # or ("motorcycle", up): the two presses gave the vertical
    drive.update(force, rate, dt_us)               # some 100 times a second, sensor's axes
    drive.measure_speed(speed_mps, age_us)         # each new value of the speed source, 1 to 10 a second
    if drive.ready: drive.matrix(out)

What to show follows from `state`, `brakings` of `needed` and, when REFUSED, from `problem.lcd`. Whether an alignment
that is there already still fits: `compare(matrix)`.
"""

from .errors import AlignmentError

# state
WAITING_FOR_SPEED = 0  # none has come yet, or none for STALE_US
WAITING_FOR_STOP = 1  # a car only: the vertical and the gyro's bias come from standing
DRIVE = 2  # waits for a braking in a straight line
BRAKING = 3  # one is going on
TURNING = 4  # one would be going on, but in a turn: not counted
READY = 5  # matrix() can be taken; keeps getting better
REFUSED = 6  # matrix() cannot be had, problem says why; goes on by itself if the reason ends

# compare()
UNKNOWN = 0  # not enough brakings yet
SAME = 1
REFINED = 2  # differs by what a pitch change on the kickstand makes: take matrix()
REVERSED = 3  # forward is backward: the kickstand was on the other side
MOVED = 4  # the mount has moved, or it was never so: align again

CAR, MOTORCYCLE = "car", "motorcycle"


class DriveAlignment:
    """vehicle: CAR or MOTORCYCLE. up: unit vector of the vertical in the sensor's axes, from the two poses, if known
    (motorcycle; without it the vertical comes from straight riding).

    state; brakings: used so far; needed: how many it takes at least; turned: brakings not counted because of a turn;
    ready; quality_deg: standard error of forward's direction (180 before the first brakings); problem: an
    AlignmentError with reason and lcd, or None.
    """

    def __init__(self, vehicle, up=None):
        self.vehicle = vehicle
        self.state = WAITING_FOR_SPEED
        self.brakings = 0
        self.needed = 5
        self.turned = 0
        self.ready = False
        self.quality_deg = 180.0
        self.problem = None

    def update(self, force, rate, dt_us):
        """force (3, g), rate (3, deg/s): calibrated, sensor's axes; dt_us: integer microseconds since the one before."""

    def measure_speed(self, speed_mps, age_us=0):
        """A new value of the speed source. age_us: how old it is known to be; an unknown lag is found by itself."""

    def matrix(self, out):
        """Fill out (9, rows left, up, forward) with vehicle-from-sensor. Raises AlignmentError while not ready."""
        raise self.problem or AlignmentError("not enough brakings in a straight line", "Brake in a", "straight line")

    def compare(self, matrix):
        """How an alignment (9, rows left, up, forward) fits what driving shows: UNKNOWN, SAME, REFINED, REVERSED or
        MOVED. Sure of REVERSED after two brakings."""
        return UNKNOWN
