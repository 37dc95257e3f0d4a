"""When each sample was taken: the chip samples at a steady rate, and that rate is corrected by the board's clock.

The chip samples evenly whatever the program does, but its clock may be off by 1 %. Times are integers of microseconds:
a 32-bit float could no longer hold them after 17 seconds.
"""

from time import ticks_add, ticks_diff

CORRECTION_SHIFT = 4  # emptied() corrects by 1/16 of the difference between the two clocks


class SampleClock:
    """period_us: nominal time from one sample to the next.  lost: samples lost in overflows, since power-on."""

    def __init__(self, period_us):
        self._period_us = period_us
        self.lost = 0
        self._pending_us = 0  # correction that the next step() adds
        self._sample_us = None  # when the last sample was taken, in ticks_us(); None: no sample yet

    def restart(self):
        """Forget the samples so far: those to come do not follow on from them."""
        self._sample_us = None
        self._pending_us = 0

    def step(self, n, now_us):
        """Count n new samples; return the microseconds from the last sample before them to the last of them.

        After a restart() there is none before them: then from the first of them. now_us: ticks_us().
        """
        if self._sample_us is None:
            n -= 1
            self._sample_us = ticks_add(now_us, -n * self._period_us)
        dt_us = max(0, n * self._period_us + self._pending_us)
        self._pending_us = 0
        self._sample_us = ticks_add(self._sample_us, dt_us)
        return dt_us

    def emptied(self, now_us):
        """Correct the clock: at now_us, ticks_us(), the chip's FIFO was empty and all its samples were counted.

        So the last sample was then half a period old on average."""
        if self._sample_us is None:
            return
        late_us = ticks_diff(now_us, self._sample_us) - self._period_us // 2
        if late_us > 2 * self._period_us:  # samples were lost in an overflow: the next step() spans the gap
            self.lost += (late_us - self._pending_us) // self._period_us
            self._pending_us = late_us
        else:
            self._pending_us = late_us >> CORRECTION_SHIFT
