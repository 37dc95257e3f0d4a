"""When each sample was taken: the chip's own steady rate, held to the microcontroller's clock.

The chip samples on time whatever the program does, but its clock may be off by 1 %. Integer microseconds
throughout: as float32 they would be wrong after 17 seconds.
"""

from time import ticks_add, ticks_diff

FOLLOW = 4  # each emptying of the FIFO corrects by 1/16 of the difference


class SampleClock:
    """period_us: nominal, of one sample. sample_us: when the last one was taken, in ticks_us()."""

    def __init__(self, period_us):
        self._period_us = period_us
        self._pending_us = 0
        self.sample_us = None

    def restart(self):
        """The samples to come do not follow on those before."""
        self.sample_us = None
        self._pending_us = 0

    def step(self, n, now_us):
        """n more samples: microseconds from the one before them to the last, or from the first where there was none.
        now_us: ticks_us()."""
        if self.sample_us is None:
            n -= 1
            self.sample_us = ticks_add(now_us, -n * self._period_us)
        dt_us = max(0, n * self._period_us + self._pending_us)
        self._pending_us = 0
        self.sample_us = ticks_add(self.sample_us, dt_us)
        return dt_us

    def emptied(self, now_us):
        """All samples taken before now_us have been stepped over: the last is half a period old on
        average."""
        if self.sample_us is None:
            return
        late_us = ticks_diff(now_us, self.sample_us) - self._period_us // 2
        if late_us > 2 * self._period_us:  # samples are missing, after an overflow: the next dt spans the gap
            self._pending_us = late_us
        else:
            self._pending_us = late_us >> FOLLOW
