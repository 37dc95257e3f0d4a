"""Is the calibration that of this ride's mount? Force, turning and speed show where up and forward are.

Up: riding, a balanced bike's force has the direction of its own up, and a car's is hardly off it. Forward: braking and
speeding up in a straight line change the force along it, so the changes of a log's speed show it. A motorcycle's bends
show it without a speed too: leaning to the right goes with turning more to the right, so a falling yaw rate goes with a
rate about forward.

A kickstand on the other side than `calibrate two` was given exchanges forward with backward and left with right, and so
do two poses that were swapped. The force alone does not show it, because braking then looks like speeding up.

On simulated rides and recordings with a right calibration up is found within 8 degrees and forward within 5.
"""

from typing import TYPE_CHECKING

import numpy as np
from kickstand.errors import Notice
from kickstand.units import AXES, STANDARD_GRAVITY

from ..signals import Array
from ..signals.calibrated import rotated
from ..signals.lag import Lag, best_lag, correlation
from ..signals.rotations import rotation_vector
from .cells import CELL_S, LogCells

if TYPE_CHECKING:
    from ..calibration.file import CalibrationFile

MEAN_S = 0.5  # means over it are judged
UP_DEG, FORWARD_DEG = 15.0, 20.0  # further off the calibration is another mount's
LEANED_DEG = 25.0  # an up that is no further off may be the pose on the kickstand, taken for the upright one
BACKWARD_DEG = 150.0
TURNING_DPS, TURNING_S = 5.0, 10.0  # up is judged where the vehicle turns: it moves there
STRAIGHT_DPS = 8.0
SPEEDS, SPEED_MPS = 20, 0.5  # changes from second to second, and their rms, at least
LATE_S = (0, 1, 2)  # delays of the speed that are tried
BENDS, BENDS_DPS = 120, 1.0  # cells, and the rms of the changes of their yaw rate, at least
# Correlations: of right calibrations over 0.85 and 0.6. Forward against all changes of speed: below it is surely
# reversed; a right one has over 0.8, on slopes of 12 % too
SURE_SPEED, SURE_BENDS, SURE_REVERSED = 0.8, 0.55, -0.6
UPSIDE_DOWN = 0.87  # cosine: within 30 degrees
ANOTHER_MOUNT_DEG = 10.0  # between two calibrations


def contradiction(cells: LogCells, calibration: "CalibrationFile") -> Notice | None:
    """What in a log contradicts a calibration; None where nothing does, or where that is not aligned."""
    if not calibration.aligned:
        return None
    ride = _Ride(cells, calibration)
    car = calibration.vehicle == "car"
    up, found, by = ride.up_deg(), ride.forward_by_speed(), "speed"
    if found is None and (ride.speed_correlation() or 0.0) < SURE_REVERSED:
        found = 180.0
    if found is None and not car:
        found, by = ride.forward_by_bends(), "bends"
    exchanged = found is not None and abs(found) > BACKWARD_DEG
    if up is not None and up > (LEANED_DEG if exchanged else UP_DEG):
        return Notice("up-off", up, car)
    if exchanged:
        return Notice("forward-exchanged", car, calibration.kickstand_side, None)  # how far up is off is not known here
    return None if found is None or abs(found) < FORWARD_DEG else Notice("forward-off", found, by, car)


def of_calibration(found: "CalibrationFile", before: "CalibrationFile | None" = None) -> list[Notice]:
    """What is remarkable in an alignment that has been found, and in the one that was given to build on.

    upside-down: accelerations of the opposite sign look like a sensor upside down, and no log shows which it is. A
    phone's x may point down: it lies on its side. another-mount: only offset and slope are taken from the one given.
    """
    notices = []
    up = found.vehicle_from_sensor[1]
    axis = int(np.argmax(np.abs(up)))
    if up[axis] < -UPSIDE_DOWN and AXES[axis] != "x":
        notices.append(Notice("upside-down", AXES[axis]))
    if before is not None and before.aligned:
        turn = rotation_vector(found.vehicle_from_sensor @ before.vehicle_from_sensor.T)
        turned_deg = float(np.degrees(np.linalg.norm(turn)))
        if turned_deg > ANOTHER_MOUNT_DEG:
            notices.append(Notice("another-mount", turned_deg))
    return notices


class _Ride:
    """A log in the axes of a calibration."""

    def __init__(self, cells: LogCells, calibration: "CalibrationFile") -> None:
        def along(over_s: float) -> tuple[Array, Array, Array]:
            """Force (n, 3, g), rate (n, 3, deg/s) less what the gyro usually reads, and the first speed (n, m/s)."""
            accel, gyro, speed = cells.means(round(over_s / CELL_S))
            force, rate = rotated(calibration.vehicle_from_sensor, *calibration.in_sensor(accel, gyro))
            return force, rate - np.nanmedian(rate, axis=0), speed

        self._force, self._rate, _ = along(MEAN_S)
        self._second_force, self._second_rate, speed = along(1.0)
        self._change_g = np.diff(speed) / STANDARD_GRAVITY

    def up_deg(self) -> float | None:
        """The angle between the calibration's up and the ride's, None where it hardly turns."""
        turning = np.linalg.norm(self._rate, axis=1) > TURNING_DPS
        if np.count_nonzero(turning) * MEAN_S < TURNING_S:
            return None
        left, up, forward = np.median(self._force[turning], axis=0)
        return float(np.degrees(np.arctan2(np.hypot(left, forward), up)))

    def forward_by_speed(self) -> float | None:
        """Degrees from the calibration's forward to the ride's, > 0 to the left; None where no speed shows it."""
        straight = np.linalg.norm(self._second_rate, axis=1) < STRAIGHT_DPS
        found = self._pushed(np.where(straight[:, None], self._second_force[:, [0, 2]], np.nan))
        return _angle_deg(found.direction) if found and found.value > SURE_SPEED else None

    def speed_correlation(self) -> float | None:
        """Between the force along the calibration's forward and the change of speed, -1 to 1."""
        found = self._pushed(self._second_force[:, 2:])
        return found.value * float(found.direction[0]) if found else None

    def _pushed(self, force: Array) -> Lag | None:
        """How the changes of speed follow from the force (n, k) in the same second, or some before; NaN for none."""

        def earlier(by: float) -> tuple[Array, Array] | None:
            change = self._change_g[int(by) :]
            there = ~np.isnan(change) & ~np.isnan(force[: len(change), 0])
            change = change[there]
            enough = len(change) >= SPEEDS and np.std(change) * STANDARD_GRAVITY >= SPEED_MPS
            return (change, force[: len(there)][there]) if enough else None

        return best_lag(LATE_S, earlier, whole=True)

    def forward_by_bends(self) -> float | None:
        """The same by leaning into bends, which a motorcycle does; None where too few bends show it."""
        if len(self._rate) < BENDS:
            return None
        turned = _smooth(self._rate[2:, 1] - self._rate[:-2, 1])
        rolled = _smooth(self._rate[1:-1])[:, [0, 2]]
        there = ~np.isnan(turned + rolled[:, 0])
        if np.count_nonzero(there) < BENDS or np.std(turned[there]) < BENDS_DPS:
            return None
        found = correlation(-turned[there], rolled[there], whole=True)
        return _angle_deg(found.direction) if found.value > SURE_BENDS else None


def _angle_deg(direction: Array) -> float:
    """From forward to a direction (2: left, forward), > 0 to the left."""
    return float(np.degrees(np.arctan2(*direction)))


def _smooth(values: Array) -> Array:
    return (values[:-2] + 2.0 * values[1:-1] + values[2:]) / 4.0
