"""Is the bike standing still? From the means of a fifth of a second, in which an idling engine averages out."""

MAX_FORCE_G = 0.010  # of a mean from the average of the last half second
MAX_RATE_RADPS = 0.009  # 0.5 deg/s, likewise
MAX_BIAS_RADPS = 0.02  # 1.2 deg/s: a longer smooth turn is no rest
MAX_FIRST_BIAS_RADPS = 0.1  # before the first rest the bias may have drifted since the calibration
REST_S = 1.5
REST_ROLLING_S = 10.0  # where a bike is known to roll, or to brake: no road is as smooth for so long
AVERAGE_S = 0.5


class RestDetector:
    """update() with each mean; resting is True after REST_S of stillness, or REST_ROLLING_S where it seemed to roll.

    first: no rest has been seen since power-on, so the bias may be off.
    """

    def __init__(self, first=True):
        self.resting = False
        self._still_s = 0.0
        self._slow_still_s = 0.0  # of it since it has not been rolling
        self._average = None
        self._max_bias = MAX_FIRST_BIAS_RADPS if first else MAX_BIAS_RADPS

    def update(self, means, bias, seconds, rolling=False):
        """means: of the last seconds, where 2..4 are rates (rad/s, bias taken off) and 5..7 forces (g). bias: that one
        (3). rolling: there is good reason to believe that the bike moves."""
        felt = [means[2 + i] + bias[i] for i in range(3)] + list(means[5:8])  # whatever is believed of the bias
        if self._average is None:
            self._average = felt
        average = self._average
        gain = min(1.0, seconds / AVERAGE_S)
        # as calibrated: or a bias that went astray, as in the hand, would never be put right
        still = small = as_calibrated = True
        for i in range(6):
            deviation = felt[i] - average[i]
            average[i] += gain * deviation
            if i < 3:
                still = still and abs(deviation) < MAX_RATE_RADPS
                small = small and abs(average[i] - bias[i]) < self._max_bias
                as_calibrated = as_calibrated and abs(average[i]) < self._max_bias
            else:
                still = still and abs(deviation) < MAX_FORCE_G
        still = still and (small or as_calibrated)
        self._still_s = self._still_s + seconds if still else 0.0
        # the even end of a braking is no rest as soon as it is slow
        self._slow_still_s = self._slow_still_s + seconds if still and not rolling else 0.0
        self.resting = self._slow_still_s >= REST_S or self._still_s >= REST_ROLLING_S
        if self.resting:
            self._max_bias = MAX_BIAS_RADPS
