"""The messages for the firmware's refusals of poses. Each code has a class.

of_firmware() converts a refusal to its message. In kickstand.calibration, still_pose refuses a single pose,
six_position and sensor_fit refuse six poses, and two_position refuses two poses.
"""

from kickstand.errors import Refusal

from ..common.messages import Message, Remedy, by_code, defined_in


class Moved(Message):
    """The sensor moved in a pose."""

    code = "moved"
    text = "moved or knocked"


class Vibration(Message):
    """The readings are noisy."""

    code = "vibration"
    text = "not still: vibration"


class Tilting(Message):
    """The mean of the readings drifts."""

    code = "tilting"
    text = "not still: slowly tilting"


class Saturated(Message):
    """The accelerometer is at the end of its range."""

    code = "saturated"
    text = "saturated: the accelerometer is at the end of its range"


class TooFew(Message):
    """The pose is too short."""

    samples: int
    least: int

    code = "too-few"
    text = "too short: {samples} samples, at least {least} needed"


class FrozenPose(Message):
    """Every reading of the pose is the same."""

    code = "frozen-pose"
    text = "frozen: every reading is the same"
    todo = Remedy("check the sensor and its wires")


class StuckAccel(Message):
    """One axis of the accelerometer has no noise."""

    axis: str

    code = "stuck-accel"
    text = "the accelerometer's reading along {axis} never changes"
    todo = Remedy("check the sensor")


class DeadGyro(Message):
    """One axis of the gyro has no noise."""

    axis: str

    code = "dead-gyro"
    text = "the gyro's rate about {axis} never changes"
    todo = Remedy("check the sensor")


class NoisyGyro(Message):
    """One axis of the gyro is too noisy."""

    axis: str

    code = "noisy-gyro"
    text = "the gyro is very noisy about {axis}"
    todo = Remedy("engine off, or check the sensor")


class GyroOffset(Message):
    """The rates at rest are too large."""

    most_dps: float

    code = "gyro-offset"
    text = "turning, or a gyro offset of over {most_dps:.0f} deg/s"


class GyroScale(Message):
    """The gyro reads wrong rates about an axis."""

    axis: str
    percent: float

    code = "gyro-scale"
    text = "by the turns between the poses the gyro's rates about {axis} are {percent:+.0f} % off"
    todo = Remedy("check the sensor, and the unit of the rates")


class GyroReversed(Message):
    """The gyro reads rates of the wrong sign about an axis."""

    axis: str

    code = "gyro-reversed"
    text = "by the turns between the poses the gyro's rates about {axis} have the wrong sign"
    todo = Remedy("check the sensor, and the axes of the log")


class GyroMisfit(Message):
    """The gyro's rates do not add up to the turn between two poses."""

    off_deg: float

    code = "gyro-misfit"
    text = "by the gyro a turn between two poses is {off_deg:.1f} degrees off"
    todo = Remedy("repeat the six positions; if it happens again, an axis of the gyro is late, clipped or dead")


class UnprovedGyro(Message):
    """The sensor was not turned about an axis."""

    axis: str

    code = "unproved-gyro"
    text = "no turn between the poses shows that the gyro is right about {axis}"
    todo = Remedy("turn the sensor about it too")


class GyroTilt(Message):
    """The gyro does not agree with the tilt between two poses."""

    tilt_deg: float
    gyro_deg: float

    code = "gyro-tilt"
    text = "between the poses are {tilt_deg:.1f} degrees, by the gyro {gyro_deg:.1f}"
    todo = Remedy("repeat the poses, or check the sensor")


class DeadAxis(Message):
    """An axis of the accelerometer hardly changes between its two sides."""

    axis: str
    change_g: float

    code = "dead-axis"
    text = "axis {axis} barely changes when turned over: {change_g:.2f} g"


class Unclear(Message):
    """The equations of the six poses have no solution."""

    code = "unclear"
    text = "the six poses do not determine the calibration"
    todo = Remedy("repeat them, each side once")


class OddAxis(Message):
    """The offset or the slope is impossible for a sensor."""

    axis: str
    offset_g: float
    slope: float

    code = "odd-axis"
    text = "axis {axis}: offset {offset_g:.3f} g, slope {slope:.3f} is out of range for a real sensor"
    todo = Remedy("repeat the six poses")


class SideTilted(Message):
    """A side did not point up."""

    side: str
    tilt_deg: float
    most_deg: float

    code = "side-tilted"
    text = "side {side} was {tilt_deg:.0f} degrees off: within {most_deg:.0f} is needed"


class FreePoseOff(Message):
    """The seventh (free) pose contradicts the calibration."""

    reads_g: float

    code = "free-pose-off"
    text = "the free pose reads {reads_g:.3f} g instead of 1"
    todo = Remedy("repeat the six poses, held still")


class NotOneG(Message):
    """One of the two poses does not read 1 g. pose: "kickstand" or "upright"."""

    pose: str
    reads_g: float

    code = "not-one-g"
    text = "{pose} reading is {reads_g:.3f} g, not 1 g"
    todo = Remedy("calibrate six positions first, or check the sensor")


class SamePose(Message):
    """The bike did not move between the poses."""

    apart_deg: float

    code = "same-pose"
    text = "both poses are the same ({apart_deg:.1f} degrees apart)"
    todo = Remedy("take one on the kickstand and one upright")


class TiltSmall(Message):
    """There is too little lean between the poses."""

    tilt_deg: float
    least_deg: float

    code = "tilt-small"
    text = "only {tilt_deg:.1f} degrees between the poses"
    todo = Remedy("at least {least_deg:.0f} are needed, lean the bike further")


class TiltLarge(Message):
    """There is too much lean between the poses."""

    tilt_deg: float
    most_deg: float

    code = "tilt-large"
    text = "{tilt_deg:.0f} degrees between the poses"
    todo = Remedy("no kickstand leans over {most_deg:.0f}, repeat both poses")


CODES = by_code(*defined_in(__name__))


def of_firmware(refusal: Refusal) -> Message:
    """Return the message for a CaptureError, CalibrationError, GyroError or AlignmentError of poses."""
    return CODES[refusal.code](*refusal.values)
