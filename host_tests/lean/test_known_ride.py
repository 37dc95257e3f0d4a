"""The lean filter's results for one ride are compared with known results. A change of the results changes every rider's
lean, so the change must be intended.

The ride has everything that affects the filter: rest, bias, a yaw error, scale errors, slopes, vibration, turns, slow
samples, measured speeds, lost samples, and a restart while riding. Other tests show the effect of each parameter. This
test notices that a parameter has changed. After an intended change, run the following line in host_tests/lean, with
firmware and tools on PYTHONPATH:

    python test_known_ride.py > known_ride.csv

Runs on MicroPython too.
"""

from math import cos, degrees, radians, sin, sqrt

from bike_motion import force_and_rate
from kickstand.lean.lean_filter import LeanFilter

# Each leg is (seconds, lean in degrees, speed in m/s, slope in degrees, True if the speed is measured each second).
# Lean, speed and slope are the values at the end of the leg.
LEGS = (
    (6, 3, 0, 2, False),
    (6, 0, 16, 0, False),
    (8, 0, 18, 1, False),
    (1, -30, 17, 0, False),
    (7, -32, 16, 0, False),
    (2, 38, 15, 1, False),
    (6, 36, 16, 3, False),
    (1, 0, 17, 3, False),
    (10, 1, 18, 0, False),
    (2, 20, 18, 0, True),
    (8, 22, 12, 0, True),
    (2, 0, 12, -2, True),
    (8, 0, 19, -2, True),
    (5, 0, 4, 0, False),
    (8, -6, 3.5, 0, False),
    (4, 0, 0, 0, False),
    (6, 0, 0, 0, False),
    (4, 0, 14, 0, False),
    (2, -35, 14, 0, False),  # the filter restarts in this leg
    (6, -33, 15, 0, False),
    (2, 7, 16, 0, False),
    (12, 7, 16, 0, False),
    (2, 40, 16, 0, False),
    (4, 40, 16, 0, True),
    (3, 0, 16, 0, False),
    (10, 0, 24, 0, False),
)
RESTART_S = 95.0
LOST = (0.01, 0.3), (60.07, 0.2), (119.12, 0.4)  # (time of the first reading after a gap, length of the gap), in s
SLOW_S = 30.0, 44.0  # begin and end of the time in which samples are 20 ms apart
BIAS = radians(0.4), radians(-0.3), radians(0.6)
YAW_ERROR = radians(4.0)
TOLERANCE = 0.001  # allowed difference besides the rounding to the four digits of known_ride.csv


def states():
    """Yield one tuple per 10 ms.

    Each tuple has four elements:
        time in s.
        values: [lean in degrees, speed in m/s, slope in degrees].
        rates: rates of change of the three values.
        True if the speed is measured.
    """
    t_s, begin = 0.0, (3, 0, 2)
    for seconds, *end, measured in LEGS:
        rates = [(b - a) / seconds for a, b in zip(begin, end)]
        for k in range(100 * seconds):
            yield t_s + k / 100.0, [a + r * k / 100.0 for a, r in zip(begin, rates)], rates, measured
        t_s, begin = t_s + seconds, end


def sensed(t_s, values, rates):
    """Return the force and the rate that a sensor with errors measures."""
    lean, speed, slope = values
    (left, up, forward), (x, y, z) = force_and_rate(lean, speed, rates[0], rates[1])
    forward += sin(radians(slope))
    x -= radians(rates[2]) * cos(radians(lean))
    y += radians(rates[2]) * sin(radians(lean))
    shake = (0.02 if speed > 1.0 else 0.003) * sin(61.0 * t_s) + 0.02 * sin(7.1 * t_s) * (speed > 10.0)
    force = [left + forward * YAW_ERROR + shake, up + 2.0 * shake, forward - left * YAW_ERROR - shake]
    x, z = x + z * YAW_ERROR, z - x * YAW_ERROR
    x, z = 1.015 * x + 0.012 * y, 0.985 * z - 0.01 * y + 0.01 * x
    return force, [x + BIAS[0] + 0.1 * shake, y + BIAS[1], z + BIAS[2] - shake]


def figures():
    """Return one row per second.

    A row has the lean and its standard deviation in degrees, the speed in m/s, pitch and trim in degrees, and 1 at rest
    or 0 otherwise.
    """
    estimator, last_s, rows = LeanFilter(), 0.0, []
    for k, (t_s, values, rates, measured) in enumerate(states()):
        if SLOW_S[0] <= t_s < SLOW_S[1] and k % 2:
            continue
        if measured and k % 100 == 50:
            estimator.measure_speed(values[1] + 0.4)
        if abs(t_s - RESTART_S) < 1e-6:
            estimator.start()
        for lost_s, seconds in LOST:
            if abs(t_s - lost_s) < 1e-6:
                estimator.inflate_covariance(seconds)
        lean = estimator.update(*sensed(t_s, values, rates), int((t_s - last_s) * 1e6 + 0.5))
        last_s = t_s
        if k % 100 == 0 and k:
            sigma = degrees(sqrt(estimator.variance))
            trim = degrees(estimator.trim.angle)
            rows.append((lean, sigma, estimator.speed_mps, estimator.pitch_deg, trim, int(estimator.at_rest)))
    return rows


def test_the_figures_of_the_known_ride_are_what_they_were():
    with open(__file__.rpartition("/")[0] + "/known_ride.csv") as file:
        references = [[float(value) for value in line.split(",")] for line in file]
    rows = figures()
    assert len(rows) == len(references)
    for t_s, (row, reference) in enumerate(zip(rows, references), 1):
        assert row[5] == reference[5], t_s
        for a, b in zip(row, reference):
            assert abs(a - b) < TOLERANCE, (t_s, row, reference)


if __name__ == "__main__":
    for row in figures():
        print(",".join(str(round(value, 4)) for value in row))
