"""Standstill detector for zero-velocity updates. The detector uses means over a fifth of a second, in which an idling
engine averages out."""

from ..units import const

# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# Largest deviation of a window's mean from the recent average at rest. Larger: smooth roads are mistaken for rest.
_MAX_FORCE_G = const(0.010)  # g
_MAX_RATE_RADPS = const(0.009)  # rad/s (equal to 0.5 deg/s)
# rad/s (1.2 deg/s): largest mean rate that may be bias. Larger: smooth bends are mistaken for rest.
MAX_BIAS_RADPS = 0.02
# rad/s: largest mean rate that may be bias before the first rest, because the bias has drifted since the calibration.
# Larger: more bends are mistaken for rest.
_MAX_FIRST_BIAS_RADPS = const(0.1)
_REST_S = const(1.5)  # s: duration of stillness that counts as rest. Larger: rest is detected later, but more reliably.
# s: duration of stillness that counts as rest if the bike seems to move or brake. No road is smooth for this long.
_REST_ROLLING_S = const(10.0)
_AVERAGE_S = const(0.5)  # s: time constant of the recent average. Larger: rest is detected later after a movement.


class RestDetector:
    """Detects rest. update() takes the means of each window.

    first: True if there was no rest since power-on, so the bias may be far off.

    resting (read-only): True after _REST_S of stillness, or after _REST_ROLLING_S if the bike seems to move.
    """

    def __init__(self, first=True):
        self.resting = False
        self._still_s = 0.0
        self._not_rolling_s = 0.0  # time of stillness without a sign that the bike moves
        self._average = None  # averages of the rates, with the estimated bias included, and of the forces
        self._max_bias = _MAX_FIRST_BIAS_RADPS if first else MAX_BIAS_RADPS

    def update(self, rates, force, bias, seconds, rolling=False, moving=False):
        """Take the means over a window.

        Args:
            rates: 3 values in rad/s, without the estimated bias.
            force: 3 values in g.
            bias: the estimated bias, 3 values in rad/s.
            seconds: duration of the window.
            rolling: True if other evidence suggests that the bike moves.
            moving: True if a measured speed proves that the bike moves.
        """
        readings = [rates[i] + bias[i] for i in range(3)] + force
        if self._average is None:
            self._average = readings
        average = self._average
        gain = min(1.0, seconds / _AVERAGE_S)
        # The average rate must be small after subtracting either the estimated bias or only the calibrated bias.
        # With only the estimated bias, a wrong estimate, as after moving the sensor by hand, would never be corrected.
        still = near_estimate = near_calibration = True
        for i in range(6):
            deviation = readings[i] - average[i]
            average[i] += gain * deviation
            if i < 3:
                still = still and abs(deviation) < _MAX_RATE_RADPS
                near_estimate = near_estimate and abs(average[i] - bias[i]) < self._max_bias
                near_calibration = near_calibration and abs(average[i]) < self._max_bias
            else:
                still = still and abs(deviation) < _MAX_FORCE_G
        still = still and (near_estimate or near_calibration) and not moving
        self._still_s = self._still_s + seconds if still else 0.0
        # Steady braking looks still, so a second timer counts only stillness without a sign of rolling. With one timer,
        # braking would count as rest as soon as the estimated speed is low.
        self._not_rolling_s = self._not_rolling_s + seconds if still and not rolling else 0.0
        self.resting = self._not_rolling_s >= _REST_S or self._still_s >= _REST_ROLLING_S
        if self.resting:
            self._max_bias = MAX_BIAS_RADPS
