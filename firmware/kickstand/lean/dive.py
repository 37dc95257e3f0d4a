"""Suspension dive: estimates while riding how far braking and acceleration pitch the bike on its springs.

In braking a telescopic fork dives, by 2.8 degrees per g on a superbike. In acceleration the rear sits down, by 1.3
degrees per g. The wheels do not rise with this pitch, so its rate times the speed is not an acceleration. The springs'
pitch is nearly proportional to the forward acceleration a. With ' for the derivative by time, the rate of this pitch is

    dive' = share a'                                                                  (8)

The part of the pitch rate that comes from the road does not depend on a'. So a regression of the pitch rate on a' gives
the share: sum(a' pitch rate) / sum(a'^2). Each sum begins with a prior.
"""

from ..units import STANDARD_GRAVITY, const

# The comment of each parameter has its unit, its meaning and, after "Larger:", the effect of a larger value.

# rad per g: share before the first braking, equal to 1.5 degrees per g. Larger: before the share is found, more of the
# pitch counts as dive.
PRIOR_SHARE = 0.026
# (g/s)^2: weight of PRIOR_SHARE, as a part of the sum of a'^2. Larger: the share is found later, and varies less.
_PRIOR_SQUARE = const(5.3)
_MIN_SHARE = const(-0.035)  # rad per g: smallest share, negative because an anti-dive fork may lift the nose
_MAX_SHARE = const(0.14)  # rad per g: largest share, 8 degrees per g, as with soft, long forks
_MIN_SPEED = const(5.0)  # m/s: lowest speed of a window that counts. Larger: the share is found later.
_MAX_JERK = const(3.0)  # g/s: largest a' that counts. Larger: bumps and lost readings count as braking.


class Dive:
    """Estimates how braking pitches the bike, in fixed memory.

    share (read-only): pitch in rad per g, positive if the nose goes down in braking.
    """

    def __init__(self):
        self.share = PRIOR_SHARE
        self._product = PRIOR_SHARE * _PRIOR_SQUARE  # sum of a' times the pitch rate
        self._square = _PRIOR_SQUARE  # sum of a'^2
        self.restart()

    def restart(self):
        """Drop the last window, because readings were missing. Keep the share, which belongs to the bike."""
        self._push = None
        self._pitch_rate = 0.0

    def update(self, push, pitch_rate, speed, seconds):
        """Take one window. Return speed x dive' / g, in g. Equations (4) and (5) need this term.

        Args:
            push: mean forward acceleration in g.
            pitch_rate: in rad/s.
            speed: in m/s.
        """
        last_push, last_rate = self._push, self._pitch_rate
        self._push, self._pitch_rate = push, pitch_rate
        if last_push is None:
            return 0.0
        jerk = (push - last_push) / seconds  # in g/s, from the middle of the last window to the middle of this window
        if not -_MAX_JERK < jerk < _MAX_JERK:  # also true for NaN
            return 0.0
        if speed > _MIN_SPEED:
            self._product += jerk * 0.5 * (pitch_rate + last_rate)
            self._square += jerk * jerk
            self.share = max(_MIN_SHARE, min(_MAX_SHARE, self._product / self._square))
        return speed * self.share * jerk / STANDARD_GRAVITY
