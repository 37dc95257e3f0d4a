"""Standstill detector for zero-velocity updates, on means over a fifth of a second, in which an idling engine averages
out."""

# Symbol = default  # unit: what it is. "Larger:" says what raising it does.
MAX_FORCE_G = 0.010  # g: deviation of a mean from the recent average. Larger: smooth roads are mistaken for rest.
MAX_RATE_RADPS = 0.009  # rad/s (0.5 deg/s): the same of rates. Larger: smooth roads are mistaken for rest.
MAX_BIAS_RADPS = 0.02  # rad/s (1.2 deg/s): mean rate that may be bias. Larger: smooth turns are mistaken for rest.
MAX_FIRST_BIAS_RADPS = 0.1  # rad/s: before the first rest, after drift since the calibration. Larger: the same.
REST_S = 1.5  # s of stillness that are rest. Larger: rest is seen later, and more surely.
REST_ROLLING_S = 10.0  # s: the same where the bike seems to move or to brake: no road is smooth for so long.
AVERAGE_S = 0.5  # s: time constant of the recent average. Larger: rest is seen later after a movement.


class RestDetector:
    """update() with the means of each window; resting is True after REST_S of stillness, or REST_ROLLING_S where the
    bike seems to move. Read only.

    first: no rest has been seen since power-on, so the bias may be far off.
    """

    def __init__(self, first=True):
        self.resting = False
        self._still_s = 0.0
        self._not_rolling_s = 0.0  # of stillness without a sign of moving
        self._average = None  # rates without the estimated bias taken off, and forces
        self._max_bias = MAX_FIRST_BIAS_RADPS if first else MAX_BIAS_RADPS

    def update(self, rates, force, bias, seconds, rolling=False):
        """Means of the last seconds: rates (rad/s) with the estimated bias taken off, that bias, and force (g).
        rolling: other evidence says that the bike moves."""
        readings = [rates[i] + bias[i] for i in range(3)] + force
        if self._average is None:
            self._average = readings
        average = self._average
        gain = min(1.0, seconds / AVERAGE_S)
        # The average rate must be small with the estimated bias taken off, or with the calibrated one alone: else an
        # estimate that went astray, as in the hand, would never be put right.
        still = near_estimate = near_calibration = True
        for i in range(6):
            deviation = readings[i] - average[i]
            average[i] += gain * deviation
            if i < 3:
                still = still and abs(deviation) < MAX_RATE_RADPS
                near_estimate = near_estimate and abs(average[i] - bias[i]) < self._max_bias
                near_calibration = near_calibration and abs(average[i]) < self._max_bias
            else:
                still = still and abs(deviation) < MAX_FORCE_G
        still = still and (near_estimate or near_calibration)
        self._still_s = self._still_s + seconds if still else 0.0
        # A second count, because the even end of a braking must not be rest as soon as the bike is slow.
        self._not_rolling_s = self._not_rolling_s + seconds if still and not rolling else 0.0
        self.resting = self._not_rolling_s >= REST_S or self._still_s >= REST_ROLLING_S
        if self.resting:
            self._max_bias = MAX_BIAS_RADPS
