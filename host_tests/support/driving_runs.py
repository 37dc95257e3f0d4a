"""Runs simulated drives through the firmware's alignment by driving. Runs on CPython and on MicroPython.

A drive is a list of legs [seconds, acceleration in m/s^2, yaw rate in deg/s]. The vehicle has no suspension, and the
road is level.
"""

import math

from kickstand.drive_alignment.alignment import DriveAlignment
from kickstand.drive_alignment.events import Fit, ForwardRegression
from kickstand.drive_alignment.quality import DriveParts
from kickstand.errors import Refusal
from kickstand.rotation import matrix
from kickstand.ui import messages

STAND = [6.0, 0.0, 0.0]
G = 9.80665
RATE_HZ = 100


def around(events=6, braking=-2.0, seconds=3.0, yaw_dps=0.0, pause_s=5.0, stands=True):
    """Return the legs of a drive: the vehicle is at rest, then speeds up and brakes `events` times.

    braking: acceleration of each braking event, in m/s^2.
    seconds: duration of each braking event.
    yaw_dps: yaw rate in each braking event.
    pause_s: time at constant speed before each braking event.
    stands: False for a drive that does not begin at rest.
    """
    legs = [list(STAND)] if stands else []
    for k in range(events):
        legs.append([4.0 + (6.0 if k == 0 else 0.0), -braking * seconds / 4.0 if k else 1.2, 12.0])
        legs.append([pause_s, 0.0, 0.0])
        legs.append([seconds, braking, yaw_dps])
        legs.append([2.0, 0.0, 0.0])
    return legs


def samples(legs, vehicle="car", tilt_deg=0.0, noise_g=0.003, start_mps=0.0):
    """Yield (force, rate, speed) at RATE_HZ, in the vehicle's axes. A motorcycle leans into turns.

    tilt_deg: camber of the road where the vehicle is at rest.
    noise_g: size of the force's noise.
    start_mps: speed at the beginning.
    """
    seed = 1
    speed = start_mps
    for seconds, acceleration, yaw_dps in legs:
        for _ in range(round(seconds * RATE_HZ)):
            previous, speed = speed, max(0.0, speed + acceleration / RATE_HZ)
            camber = math.radians(tilt_deg) if previous == speed == 0.0 else 0.0
            force = [math.sin(camber), math.cos(camber), (speed - previous) * RATE_HZ / G]
            rate = [0.0, yaw_dps, 0.0]
            side = speed * math.radians(yaw_dps) / G
            if vehicle == "car":
                force[0] += side
            else:
                lean = math.atan(side)  # the lean is positive, to the left, in a left turn
                force[1] = math.sqrt(1.0 + side * side)
                rate[0], rate[1] = yaw_dps * math.sin(lean), yaw_dps * math.cos(lean)
            for i in range(3):
                seed = (seed * 1103515 + 12345) % 0x1000000
                force[i] += noise_g * (seed / 0x800000 - 1.0)
            yield force, rate, speed


def mounted(m, vector):
    """Convert a vector from the vehicle's axes to the sensor's axes.

    m: the matrix from the sensor's to the vehicle's axes, nine numbers in the rows left, up, forward.
    """
    x, y, z = vector
    return [m[i] * x + m[3 + i] * y + m[6 + i] * z for i in range(3)]


class SpeedSource:
    """A GPS receiver with errors.

    every_s: time between two speeds.
    late_s: delay of a speed.
    scale: factor on each speed.
    step: each speed is rounded to a multiple of this step, in m/s. 0: no rounding.
    stuck_from_s: the speed stays the same from this time on.
    silent: (begin, end) of a time without any speed, in s.
    """

    def __init__(self, every_s=0.5, late_s=0.0, scale=1.0, step=0.0, stuck_from_s=1e9, silent=(1e9, 1e9)):
        self.every = round(every_s * RATE_HZ)
        self.late = round(late_s * RATE_HZ)
        self.scale, self.step = scale, step
        self.stuck_from, self.silent = stuck_from_s * RATE_HZ, [s * RATE_HZ for s in silent]
        self.past = []
        self.count = 0
        self.last = 0.0

    def step_to(self, speed):
        """Advance by 10 ms. Return a new speed, or None."""
        self.past.append(speed)
        if len(self.past) > self.late + 1:
            self.past.pop(0)
        self.count += 1
        if (self.count - 1) % self.every or self.silent[0] < self.count <= self.silent[1]:
            return None
        if self.count < self.stuck_from:
            self.last = self.past[0] * self.scale
            if self.step:
                self.last = round(self.last / self.step) * self.step
        return self.last


def drive(legs, mount, options):
    """Run the legs through an alignment by driving and return its results by name.

    mount: the matrix from the sensor's to the vehicle's axes, nine numbers in the rows left, up, forward.
    options:
        vehicle: "car" or "motorcycle".
        method: "published" for ViriCiti's method.
        up, bias: passed to the alignment.
        source: arguments of SpeedSource.
        samples: arguments of samples().
        gyro_bias: three numbers in deg/s.
        moved: [from_s, mount from then on].
    """
    vehicle = options.get("vehicle", "car")
    source = SpeedSource(**options.get("source", {}))
    method = DriveAlignment
    if options.get("method") == "published":
        from kickstand_tools.calibration.published import PublishedAlignment as method  # runs on CPython only
    alignment = method(vehicle, options.get("up"), options.get("bias"))
    moved_at, other = options.get("moved", [1e9, mount])
    bias = options.get("gyro_bias", [0.0, 0.0, 0.0])
    rows = samples(legs, vehicle, **options.get("samples", {}))
    for k, (force, rate, speed) in enumerate(rows):
        m = mount if k < moved_at * RATE_HZ else other
        turning = mounted(m, rate)
        alignment.update(mounted(m, force), [turning[i] + bias[i] for i in range(3)], 0 if k == 0 else 10000)
        value = source.step_to(speed)
        if value is not None:
            alignment.measure_speed(value)
    alignment.finish()
    result = {
        "ready": alignment.ready,
        "stops": alignment.standing.stops,
        "bias": list(alignment.standing.bias),
    }
    if isinstance(alignment, DriveAlignment):
        result["lag"] = alignment.events.lag_s
    out = matrix()
    try:
        alignment.matrix(out)
        result["matrix"] = list(out)
    except Refusal as refusal:
        result["refused"] = refusal.code
        result["values"] = list(refusal.values)
        result["lcd"] = messages.lines(refusal)
    return result


def regression(rows, lag):
    """Run the regression over rows of an event, and return its forward, level and blocks.

    rows: each row is [seconds, change_g, curve_g, three forces]. Every tenth row ends an event.
    """
    fitted, fit = ForwardRegression(), Fit()
    for k, (seconds, change, curve, force) in enumerate(rows):
        fitted.add(lag, seconds, change, curve, force)
        if k % 10 == 9:
            for _ in fitted.end_event():
                pass
    fitted.fit(fit, lag)
    return list(fit.forward), list(fit.level), fitted.blocks


def parts(blocks):
    """Compare the parts of a drive, and return their forward_deg, sigmas, roll_deg and pitch_deg.

    blocks: each block is [across, along, roll_g, pitch_g, weight, seconds].
    """
    compared = DriveParts()
    for block in blocks:
        compared.add(*block)
    for _ in compared.compare():
        pass
    return compared.forward_deg, compared.sigmas, compared.roll_deg, compared.pitch_deg
