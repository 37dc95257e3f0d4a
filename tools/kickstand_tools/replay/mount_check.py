"""Is the calibration that of this ride's mount? Force, turning and speed show where up and forward are.

Up: riding, a balanced bike's force has the direction of its own up, and a car's is hardly off it. Forward: braking and
speeding up in a straight line change the force along it, so the changes of a log's speed tell it. A motorcycle's bends
tell it without a speed too: leaning to the right goes with turning more to the right, so a falling yaw rate goes with a
rate about forward.

On simulated rides and recordings with a right calibration up is found within 8 degrees and forward within 5.
"""

import numpy as np
from kickstand.errors import Notice
from kickstand.units import STANDARD_GRAVITY

from ..calibration.file import CalibrationFile
from ..logs.log import Log
from ..logs.table import Array
from ..logs.time_cells import no_cells, with_block
from .forward_sign import ForwardSign, exchanged_notice

CELL_S = 0.5  # means over it
KEPT = 7200  # cells: an hour
UP_DEG, FORWARD_DEG = 15.0, 20.0  # further off the calibration is another mount's
LEANED_DEG = 25.0  # an up that is no further off may be the pose on the kickstand, taken for the upright one
BACKWARD_DEG = 150.0
TURNING_DPS, TURNING_S = 5.0, 10.0  # up is judged where the vehicle turns: it moves there
STRAIGHT_DPS = 8.0
SPEEDS, SPEED_MPS = 20, 0.5  # changes from second to second, and their rms, at least
LATE_S = (0, 1, 2)  # delays of the speed that are tried
BENDS, BENDS_DPS = 120, 1.0  # cells, and the rms of the changes of their yaw rate, at least
SURE_SPEED, SURE_BENDS = 0.8, 0.55  # correlations; right calibrations have over 0.85 and 0.6


class MountCheck:
    """add() takes a ride's samples, in the vehicle's axes by this calibration; notice() judges them."""

    def __init__(self, calibration: CalibrationFile) -> None:
        self.sign = ForwardSign()
        self._calibration = calibration
        self._cells = no_cells()

    def add(self, time_s: Array, force: Array, rate: Array, speed_mps: Array) -> None:
        """n samples. force (n, 3, g), rate (n, 3, deg/s): left, up, forward; speed NaN where there is no new one."""
        if not len(time_s):
            return
        self.sign.add(time_s, force[:, 2], speed_mps)
        self._cells = with_block(self._cells, CELL_S, time_s, force, rate, speed_mps)[-KEPT:]

    def notice(self, roll_deg: float | None = None) -> Notice | None:
        """What contradicts the calibration; None where nothing does. roll_deg: as exchanged_notice() takes it."""
        if not self._calibration.aligned or len(self._cells) < 3:
            return None
        car = self._calibration.vehicle == "car"
        up, found, by = self.up_deg(), self.forward_by_speed(), "speed"
        if found is None and self.sign.exchanged:
            found = 180.0
        if found is None and not car:
            found, by = self.forward_by_bends(), "bends"
        exchanged = found is not None and abs(found) > BACKWARD_DEG
        if up is not None and up > (LEANED_DEG if exchanged else UP_DEG):
            return Notice("up-off", up, car)
        if found is None or abs(found) < FORWARD_DEG:
            return None
        return exchanged_notice(self._calibration, roll_deg) if exchanged else Notice("forward-off", found, by, car)

    def up_deg(self) -> float | None:
        """The angle between the calibration's up and the ride's, None where it hardly turns."""
        force, rate, _ = self._evenly()
        turning = np.linalg.norm(rate, axis=1) > TURNING_DPS
        if np.count_nonzero(turning) * CELL_S < TURNING_S:
            return None
        left, up, forward = np.median(force[turning], axis=0)
        return float(np.degrees(np.arctan2(np.hypot(left, forward), up)))

    def forward_by_speed(self) -> float | None:
        """Degrees from the calibration's forward to the ride's, > 0 to the left; None where no speed tells it."""
        force, rate, speed = (_pairs(values) for values in self._evenly())
        level = np.mean(force, axis=1)[:, [0, 2]]
        straight = np.linalg.norm(np.mean(rate, axis=1), axis=1) < STRAIGHT_DPS
        first = np.where(np.isnan(speed[:, 0]), speed[:, 1], speed[:, 0])
        change = np.diff(first) / STANDARD_GRAVITY
        best, found = SURE_SPEED, None
        for late in LATE_S:
            pushed = change[late:]
            told = straight[: len(pushed)] & ~np.isnan(pushed)
            if np.count_nonzero(told) < SPEEDS or np.std(pushed[told]) * STANDARD_GRAVITY < SPEED_MPS:
                continue
            correlation, angle = _direction(pushed[told], level[: len(pushed)][told])
            if correlation > best:
                best, found = correlation, angle
        return found

    def forward_by_bends(self) -> float | None:
        """The same by leaning into bends, which a motorcycle does; None where too few bends tell it."""
        _, rate, _ = self._evenly()
        if len(rate) < BENDS:
            return None
        turned = _smooth(rate[2:, 1] - rate[:-2, 1])
        rolled = _smooth(rate[1:-1])[:, [0, 2]]
        told = ~np.isnan(turned + rolled[:, 0])
        if np.count_nonzero(told) < BENDS or np.std(turned[told]) < BENDS_DPS:
            return None
        correlation, angle = _direction(-turned[told], rolled[told])
        return angle if correlation > SURE_BENDS else None

    def _evenly(self) -> tuple[Array, Array, Array]:
        """Force (n, 3, g), rate (n, 3, deg/s) without what the gyro usually reads, and speed (n, m/s) of each cell from
        the first one to the last; NaN where there are no samples."""
        places = (self._cells[:, 0] - 2.0 * np.floor(self._cells[0, 0] / 2.0)).astype(int)  # a second has two
        count = int(places[-1]) + 1 if len(places) and places[-1] < 100 * KEPT else 0  # else not one ride
        found = np.full((count, 7), np.nan)
        if count:
            found[places, :6] = self._cells[:, 1:7] / self._cells[:, 7:8]
            found[places, 6] = self._cells[:, 8]
            found[:, 3:6] -= np.nanmedian(found[:, 3:6], axis=0)
        return found[:, :3], found[:, 3:6], found[:, 6]


def contradiction(log: Log, calibration: CalibrationFile) -> Notice | None:
    """What in a whole log contradicts a calibration; None where nothing does."""
    check = MountCheck(calibration)
    check.add(log.t_s, *calibration.in_vehicle(log.readings), log.speed_mps)
    return check.notice()


def _direction(cause: Array, level: Array) -> tuple[float, float]:
    """Correlation of cause (n) and the vectors level (n, 2: left, forward), and the angle from forward to the direction
    in which they go together, degrees, > 0 to the left."""
    cause, level = cause - np.mean(cause), level - np.mean(level, axis=0)
    left, forward = cause @ level
    size = float(np.sqrt((cause @ cause) * np.sum(level * level)))
    return float(np.hypot(left, forward)) / max(size, 1e-12), float(np.degrees(np.arctan2(left, forward)))


def _pairs(values: Array) -> Array:
    return values[: len(values) // 2 * 2].reshape(-1, 2, *values.shape[1:])


def _smooth(values: Array) -> Array:
    return (values[:-2] + 2.0 * values[1:-1] + values[2:]) / 4.0
