"""x"""

SHORT_S = 3.0  # s: time constant of the short means. Larger: seen later, and less of what is sound.
LONG_S = 10.0  # s: of the long ones. Larger: as above.
MOST = 4.0  # standard deviations: more counts as this. Larger: a blow counts for more.
LEFT_SHORT, LEFT_LONG = 0.75, 0.5
UP_SHORT, UP_LONG = 0.9, 0.35
SIDEWAYS = 0.15
PITCH = 0.21
FIT_SHARE = 0.6
HOLDS = (3.0, 4.0, 5.0, 20.0, 60.0)
FORGET_S = 60.0  # s: fitting for so long takes one doubt back. Larger: a fault that comes again is named more surely.
MILD = 3
NAMED = 3  # doubts after which the sensor is called odd


def clip(x):
    return max(-MOST, min(MOST, x))


class Consistency:
    def __init__(self):
        self.doubt = False
        self.odd = None
        self._doubts = 0
        self._fits_s = 0.0
        self.reset_means()

    def reset_means(self):
        self._left = self._left_long = self._up = self._up_long = self._side = self._pitch = 0.0

    def add(self, left, up, sideways, pitch, yaw_rate, seconds):
        left, up = clip(left), clip(up)
        gain, long_gain = min(1.0, seconds / SHORT_S), min(1.0, seconds / LONG_S)
        self._left += gain * (left - self._left)
        self._up += gain * (up - self._up)
        self._left_long += long_gain * (left - self._left_long)
        self._up_long += long_gain * (up - self._up_long)
        self._side += long_gain * (max(-.5, min(.5, sideways)) - self._side)
        self._pitch += long_gain * (pitch - self._pitch)
        of_left = max(abs(self._left) / LEFT_SHORT, abs(self._left_long) / LEFT_LONG, abs(self._side)/SIDEWAYS)
        of_up = max(abs(self._up) / UP_SHORT, abs(self._up_long) / UP_LONG)
        of_pitch = abs(self._pitch)/PITCH
        if max(of_left, of_up, of_pitch) > (0.7 if self._doubts else 1.0):
            self._doubts += 1
            self.reset_means()
            self.doubt, self._fits_s = True, 0.0
            if self._doubts >= NAMED:
                self.odd = "left" if of_left > of_up else "up"
            return self._doubts
        if self.doubt and max(of_left, of_up, of_pitch) > FIT_SHARE:
            self._fits_s = 0.0
        if abs(yaw_rate) > 0.05 or self._doubts <= MILD:
            self._fits_s += seconds
        if self.doubt and self._fits_s >= HOLDS[min(self._doubts, len(HOLDS)) - 1]:
            self.doubt, self.odd, self._fits_s = False, None, 0.0
        elif self._fits_s >= FORGET_S and self._doubts:
            self._doubts -= 1
            self._fits_s = 0.0
        return 0
