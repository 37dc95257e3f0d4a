"""The messages for the firmware's refusals of poses and drives. of_firmware() converts a refusal to its message.

In kickstand.calibration, poses refuses a single pose and two poses, and six_position refuses six poses.
kickstand.drive_alignment refuses drives.
"""

from kickstand.errors import Refusal

from ..checks.log import SpeedStuck, SpeedUnit
from ..common.messages import Message, Remedy, by_code, kind

Moved = kind("moved", text="moved or knocked")
Vibration = kind("vibration", text="not still: vibration")
Tilting = kind("tilting", text="not still: slowly tilting")
Saturated = kind("saturated", text="saturated: the accelerometer is at the end of its range")
TooFew = kind("too-few", "samples least", "too short: {samples} samples, at least {least} needed")
FrozenPose = kind(
    "frozen-pose", text="frozen: every reading is the same", todo=Remedy("check the sensor and its wires")
)
StuckAccel = kind(
    "stuck-accel", "axis", "the accelerometer's reading along {axis} never changes", Remedy("check the sensor")
)
DeadGyro = kind("dead-gyro", "axis", "the gyro's rate about {axis} never changes", Remedy("check the sensor"))
NoisyGyro = kind("noisy-gyro", "axis", "the gyro is very noisy about {axis}", Remedy("engine off, or check the sensor"))
GyroOffset = kind("gyro-offset", "most_dps", "turning, or a gyro offset of over {most_dps:.0f} deg/s")
GyroScale = kind(
    "gyro-scale",
    "axis percent",
    "by the turns between the poses the gyro's rates about {axis} are {percent:+.0f} % off",
    Remedy("check the sensor, and the unit of the rates"),
)
GyroReversed = kind(
    "gyro-reversed",
    "axis",
    "by the turns between the poses the gyro's rates about {axis} have the wrong sign",
    Remedy("check the sensor, and the axes of the log"),
)
GyroMisfit = kind(
    "gyro-misfit",
    "off_deg",
    "by the gyro a turn between two poses is {off_deg:.1f} degrees off",
    Remedy("repeat the six positions; if it happens again, an axis of the gyro is late, clipped or dead"),
)
UnprovedGyro = kind(
    "unproved-gyro",
    "axis",
    "no turn between the poses shows that the gyro is right about {axis}",
    Remedy("turn the sensor about it too"),
)
GyroTilt = kind(
    "gyro-tilt",
    "tilt_deg gyro_deg",
    "between the poses are {tilt_deg:.1f} degrees, by the gyro {gyro_deg:.1f}",
    Remedy("repeat the poses, or check the sensor"),
)
DeadAxis = kind("dead-axis", "axis change_g", "axis {axis} barely changes when turned over: {change_g:.2f} g")
Unclear = kind(
    "unclear", text="the six poses do not determine the calibration", todo=Remedy("repeat them, each side once")
)
OddAxis = kind(
    "odd-axis",
    "axis offset_g slope",
    "axis {axis}: offset {offset_g:.3f} g, slope {slope:.3f} is out of range for a real sensor",
    Remedy("repeat the six poses"),
)
SideTilted = kind(
    "side-tilted",
    "side tilt_deg most_deg",
    "side {side} was {tilt_deg:.0f} degrees off: within {most_deg:.0f} is needed",
)
FreePoseOff = kind(
    "free-pose-off",
    "reads_g",
    "the free pose reads {reads_g:.3f} g instead of 1",
    Remedy("repeat the six poses, held still"),
)
NotOneG = kind(
    "not-one-g",
    "pose reads_g",
    "{pose} reading is {reads_g:.3f} g, not 1 g",
    Remedy("calibrate six positions first, or check the sensor"),
)
SamePose = kind(
    "same-pose",
    "apart_deg",
    "both poses are the same ({apart_deg:.1f} degrees apart)",
    Remedy("take one on the kickstand and one upright"),
)
TiltSmall = kind(
    "tilt-small",
    "tilt_deg least_deg",
    "only {tilt_deg:.1f} degrees between the poses",
    Remedy("at least {least_deg:.0f} are needed, lean the bike further"),
)
TiltLarge = kind(
    "tilt-large",
    "tilt_deg most_deg",
    "{tilt_deg:.0f} degrees between the poses",
    Remedy("no kickstand leans over {most_deg:.0f}, repeat both poses"),
)

_MOVED = {
    "between-stops": "two stops differ by over {angle_deg:.0f} degrees; those of a motorcycle on its kickstand do: is "
    "it one?",
    "vertical": "the vertical changed by {angle_deg:.0f} degrees during the drive",
    "parts": "the vertical is no longer where it was",
    "since-standing": "standing and driving differ by {angle_deg:.0f} degrees",
    "since-upright": "the upright pose and driving differ by {angle_deg:.0f} degrees",
    "forward": "forward is no longer where it was",
    "since-alignment": "it is no longer as it was aligned",
}
# how: a key of _MOVED; angle_deg: angle by which the mount moved, or None if unknown
MountMoved = kind(
    "mount-moved",
    "how angle_deg=None",
    lambda message: "the mount has moved: " + _MOVED[message.how].format(angle_deg=message.angle_deg),
)
SpeedNegative = kind("speed-negative", "speed_mps", "the speed is {speed_mps:.1f} m/s: it must not be negative")
SpeedLate = kind("speed-late", "late_s", "the speed is {late_s:.1f} s late", Remedy("under 2 s are needed"))
NoSpeed = kind("no-speed", text="no speed", todo=Remedy("it needs a speed, from a GPS or a wheel"))
NotDriven = kind(
    "not-driven", "needed", "it only stood still", Remedy("drive, and brake in a straight line {needed} times")
)
NotStopped = kind(
    "not-stopped", "stop_s", "it never stood still", Remedy("a stop of {stop_s:.0f} s is needed for the vertical")
)
FewEvents = kind(
    "few-events",
    "used needed turned",
    "only {used} of {needed} braking events in a straight line, {turned} more were not straight: not enough for "
    "forward",
)
PartsDiffer = kind(
    "parts-differ",
    "differ_deg",
    "two parts of the drive disagree by {differ_deg:.0f} degrees about forward",
    Remedy("did the mount move? Else drive on"),
)
Uncertain = kind(
    "uncertain",
    "sigma_deg used",
    "forward is known to {sigma_deg:.1f} degrees only, after {used} braking events",
    Remedy("drive on"),
)

# Each kind() of this module, and the two of checks that are also the firmware's
_OWN = [each for each in globals().values() if isinstance(each, type) and each.__module__ == __name__]
KINDS = by_code(SpeedStuck, SpeedUnit, *_OWN)


def of_firmware(refusal: Refusal) -> Message:
    """Return the message for a Refusal of the firmware."""
    return KINDS[refusal.code](*refusal.values)
