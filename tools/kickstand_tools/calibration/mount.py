"""Checks that a calibration fits the mount of a ride. Force, rates and speed show where up and forward are.

* The force shows up. On a balanced bike, the force while riding points along the bike's own up axis. In a car the force
  nearly points along up.
* The speed shows forward. Braking and speeding up in a straight line change the force along the forward axis. So this
  force correlates with the changes of the log's speed.
* The bends of a motorcycle show forward without a speed. A bike that leans further to the right also yaws faster to the
  right. So the rate about forward correlates with minus the change of the yaw rate.

If `calibrate two` got the wrong side of the kickstand, or if two poses were swapped, forward and backward are
exchanged, and so are left and right. The force alone does not show this, because braking then looks like speeding up.

In simulated and recorded rides with a correct calibration, up is found within 8 degrees and forward within 5.
"""

import numpy as np
from kickstand.units import AXES, STANDARD_GRAVITY

from ..checks.log import CheckedLog, read_checked
from ..common.messages import AT_REST, OPPOSITE_SIGN, Message, Remedy, WrongMount, kind
from ..logs.log import BIN_S, LogBins, Source
from ..logs.source import Progress
from ..signals import Array, Lag, best_lag, correlation, rotated, rotation_vector
from .file import CalibrationFile

MEAN_S = 0.5  # means over this time are used to judge up and the bends
# If up or forward differs by more, the calibration belongs to another mount. FEW_FORWARD_DEG is for under two
# minutes of bends
UP_DEG, FORWARD_DEG, FEW_FORWARD_DEG = 15.0, 25.0, 40.0
# If the two poses were swapped, "up" is the up axis of the bike on the kickstand. That axis leans by up to LEANED_DEG.
LEANED_DEG = 25.0
BACKWARD_DEG = 150.0  # if forward differs by more than this, forward and backward are exchanged
TURNING_DPS, TURNING_S = 5.0, 10.0  # up is judged if the rates are over TURNING_DPS for at least TURNING_S in all
STRAIGHT_DPS = 8.0  # the speed shows forward where the rates are under this
# forward_by_speed() needs this many changes of speed from second to second, with this standard deviation
SPEEDS, SPEED_MPS = 20, 0.5
LATE_S = (0, 1, 2)  # delays of the speed that are tried
BENDS, BENDS_DPS = 120, 1.0  # least number of means for forward_by_bends(), and least spread of their yaw rate
# Forward is certain if its correlation is over SURE_SPEED (by the speed) or SURE_BENDS (by the bends). With a correct
# calibration, the correlation is over 0.85 by the speed and over 0.6 by the bends.
SURE_SPEED, SURE_BENDS = 0.8, 0.55
# Forward is certainly reversed if the force along forward has a lower correlation than this with all changes of speed.
# A correct calibration has over 0.8, even on slopes of 12 %.
SURE_REVERSED = -0.6
UPSIDE_DOWN = 0.87  # cosine of 30 degrees: an axis closer than this to straight down points down
ANOTHER_MOUNT_DEG = 10.0  # if two alignments differ by more than this, they belong to different mounts
SWAPPED_DEG = 4.0  # an upright pose is hardly ever this far from upright, but a pose on the kickstand always is
UPSIDE_DOWN_DEG = 150.0  # if up differs by more than this, the accelerations may have the opposite sign
# The remedies for a motorcycle, and for a car
AGAIN = Remedy(
    "is it another mount's? Calibrate again: calibrate two, or calibrate ride",
    "is it another mount's? Remove the calibration and let the ride show how the sensor sits, or align the bike again",
)
AGAIN_CAR = Remedy(
    "is it another mount's? Calibrate again: calibrate drive",
    "is it another mount's? Give the calibration of this mount",
)


def _again(message) -> Remedy:
    return AGAIN_CAR if message.car else AGAIN


def _up_off_remedy(message) -> Remedy:
    again = _again(message)
    return again.followed(f". Or {OPPOSITE_SIGN}") if message.angle_deg > UPSIDE_DOWN_DEG else again


def _forward_off_words(message) -> str:
    side = "left" if message.angle_deg > 0.0 else "right"
    wrong = "braking and cornering are" if message.car else "lean, braking and cornering are"
    return (
        f"by the {message.by} of this ride forward is {abs(message.angle_deg):.0f} degrees to the {side} of the "
        f"calibration's, so {wrong} wrong"
    )


def _exchanged_remedy(message) -> Remedy:
    if message.car:
        remedy = Remedy("calibrate drive again?", "was it aligned while driving backwards?")
    elif message.roll_deg is not None and abs(message.roll_deg) > SWAPPED_DEG:
        remedy = Remedy("were the poses swapped?")
    else:
        option = {"left": "--side right", "right": "--side left"}.get(message.side, "with the other --side")
        remedy = Remedy(
            f"calibrate two {option}?",
            "does the kickstand lean the bike to the other side than SIDE in config.py says?",
        )
        remedy = remedy if message.roll_deg is not None else remedy.followed(" Or were the poses swapped?")
    return remedy.followed(f" Or, if no board wrote this log, {OPPOSITE_SIGN}")


# car: True for a car, False for a motorcycle
UpOff = kind(
    "up-off",
    "angle_deg car",
    "the calibration's up is {angle_deg:.0f} degrees off, so nothing computed with it is right",
    _up_off_remedy,
    WrongMount,
)
# angle_deg: angle from the calibration's forward to the ride's, positive to the left; by: "speed" or "bends"
ForwardOff = kind("forward-off", "angle_deg by car", _forward_off_words, _again, WrongMount)
# side: side of the kickstand in the calibration by two poses, or ""; roll_deg: roll error of up, or None if unknown. It
# shows whether the two poses were swapped.
ForwardExchanged = kind(
    "forward-exchanged",
    "car side roll_deg",
    "forward and backward are exchanged",
    _exchanged_remedy,
    WrongMount,
    judged=True,
)
UpsideDown = kind(
    "upside-down",
    "axis",
    "the sensor's {axis} points down",
    Remedy(
        "if it is not mounted upside down, all accelerations are of the opposite sign, and left and right get "
        f"exchanged: reverse them ({AT_REST})"
    ),
    WrongMount,
)
AnotherMount = kind(
    "another-mount",
    "angle_deg",
    "the calibration given is of a mount {angle_deg:.0f} degrees from this one: its offset and slope are used",
    base=WrongMount,
)


def read_ride(source: Source, calibration: CalibrationFile, progress: Progress | None = None) -> CheckedLog:
    """Read and check a ride, as read_checked(). The notices also say how the ride contradicts its calibration."""
    ride = read_checked(source, progress)
    problem = contradiction(ride.bins, calibration)
    ride.notices += [problem] if problem else []
    ride.bins = None  # they use memory, and no other check needs them
    return ride


def contradiction(bins: LogBins | None, calibration: CalibrationFile) -> Message | None:
    """Return a notice that says how a log contradicts an aligned calibration, or None."""
    if bins is None or not calibration.aligned:
        return None
    ride = _Ride(bins, calibration)
    car = calibration.vehicle == "car"
    up, forward, by = ride.up_deg(), ride.forward_by_speed(), "speed"
    if forward is None and (ride.speed_correlation() or 0.0) < SURE_REVERSED:
        forward = 180.0  # certainly reversed, although the angle is uncertain
    if forward is None and not car:
        forward, by = ride.forward_by_bends(), "bends"
    exchanged = forward is not None and abs(forward) > BACKWARD_DEG
    if up is not None and up > (LEANED_DEG if exchanged else UP_DEG):
        return UpOff(up, car)
    if exchanged:
        return ForwardExchanged(car, calibration.kickstand_side, None)  # None: the error of up is unknown
    return None if forward is None or abs(forward) < FORWARD_DEG else ForwardOff(forward, by, car)


def of_calibration(new: CalibrationFile, earlier: CalibrationFile | None = None) -> list[Message]:
    """Return notices about a new alignment.

    Accelerations of the opposite sign look like a sensor upside down, so the user is asked. An x axis that points down
    gives no notice, because a phone can lie on its side. If the earlier calibration, whose offset and slope are used,
    belongs to another mount, a notice says so.
    """
    notices: list[Message] = []
    up = new.vehicle_from_sensor[1]
    axis = int(np.argmax(np.abs(up)))
    if up[axis] < -UPSIDE_DOWN and AXES[axis] != "x":
        notices.append(UpsideDown(AXES[axis]))
    if earlier is not None and earlier.aligned:
        turn = rotation_vector(new.vehicle_from_sensor @ earlier.vehicle_from_sensor.T)
        turned_deg = float(np.degrees(np.linalg.norm(turn)))
        if turned_deg > ANOTHER_MOUNT_DEG:
            notices.append(AnotherMount(turned_deg))
    return notices


class _Ride:
    """A log in the axes of a calibration."""

    def __init__(self, bins: LogBins, calibration: CalibrationFile) -> None:
        def along(over_s: float) -> tuple[Array, Array, Array]:
            """Return mean force in g, mean rate minus its median over the ride in deg/s, each of shape (n, 3), and the
            first speed in m/s of n stretches of over_s seconds."""
            accel, gyro, speed = bins.means(round(over_s / BIN_S))
            force, rate = rotated(calibration.vehicle_from_sensor, *calibration.in_sensor(accel, gyro))
            return force, rate - np.nanmedian(rate, axis=0), speed

        self._force, self._rate, _ = along(MEAN_S)
        self._second_force, self._second_rate, speed = along(1.0)
        self._change_g = np.diff(speed) / STANDARD_GRAVITY

    def up_deg(self) -> float | None:
        """The angle between the calibration's up and the ride's; None if the ride has hardly any bends."""
        turning = np.linalg.norm(self._rate, axis=1) > TURNING_DPS
        if np.count_nonzero(turning) * MEAN_S < TURNING_S:
            return None
        # In a ride that is mostly one steady bend, the median rate is the bend's, and the rest of the ride turns
        known = ~np.isnan(self._force[:, 0])
        forces = [np.median(self._force[part], axis=0) for part in (turning, known)]
        return min(float(np.degrees(np.arctan2(np.hypot(left, forward), up))) for left, up, forward in forces)

    def forward_by_speed(self) -> float | None:
        """Find the angle from the calibration's forward to the ride's by the changes of speed, in degrees, positive to
        the left; None if it is uncertain."""
        straight = np.linalg.norm(self._second_rate, axis=1) < STRAIGHT_DPS
        lag = self._lag_of_speed(np.where(straight[:, None], self._second_force[:, [0, 2]], np.nan))
        return _angle_deg(lag.direction) if lag and lag.value > SURE_SPEED else None

    def speed_correlation(self) -> float | None:
        """The correlation of the force along forward with the changes of speed; None without enough speeds."""
        lag = self._lag_of_speed(self._second_force[:, 2:])
        return lag.value * float(lag.direction[0]) if lag else None

    def _lag_of_speed(self, force: Array) -> Lag | None:
        """Find the Lag of the changes of speed behind the force, shape (n, k), NaN where it must not be used; None if
        there are too few changes."""

        def earlier(by: float) -> tuple[Array, Array] | None:
            change = self._change_g[int(by) :]
            cause = force[: len(change)]
            valid = ~np.isnan(change) & ~np.isnan(cause[:, 0])
            enough = np.count_nonzero(valid) >= SPEEDS and np.std(change[valid]) * STANDARD_GRAVITY >= SPEED_MPS
            return (change[valid], cause[valid]) if enough else None

        return best_lag(LATE_S, earlier, whole=True)

    def forward_by_bends(self) -> float | None:
        """Find forward from the way a motorcycle leans into bends. For the result see forward_by_speed()."""
        if len(self._rate) < BENDS:
            return None
        yaw_change = _smooth(self._rate[2:, 1] - self._rate[:-2, 1])
        roll_rate = _smooth(self._rate[1:-1])[:, [0, 2]]
        valid = ~np.isnan(yaw_change + roll_rate[:, 0])
        if np.count_nonzero(valid) < BENDS or np.std(yaw_change[valid]) < BENDS_DPS:
            return None
        lean = correlation(-yaw_change[valid], roll_rate[valid], whole=True)
        angle_deg = _angle_deg(lean.direction)
        unsure = np.count_nonzero(valid) < 2 * BENDS and FORWARD_DEG < abs(angle_deg) < FEW_FORWARD_DEG
        return angle_deg if lean.value > SURE_BENDS and not unsure else None


def _angle_deg(direction: Array) -> float:
    """The angle from forward to a direction (left, forward), in degrees, positive to the left."""
    return float(np.degrees(np.arctan2(*direction)))


def _smooth(values: Array) -> Array:
    return (values[:-2] + 2.0 * values[1:-1] + values[2:]) / 4.0
