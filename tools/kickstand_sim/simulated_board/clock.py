"""The board's time in integer microseconds. The time advances only when something on the board takes time."""

import time as _host_time
from heapq import heappop, heappush

# Saved, because under MicroPython Board.install() later replaces `time`
_host_ns, _host_sleep = _host_time.time_ns, _host_time.sleep

NEVER_US = 1 << 60  # a time later than the end of any run
_DUE_US, _FUNCTION = 0, 2  # indices in an entry of Clock._events
_PACE_STEP_US = 5000  # time between two comparisons of a paced clock with the host's clock


def _host_us():
    return _host_ns() // 1000


class PowerOff(BaseException):
    """Ends the program on the board after a power cut. A BaseException, because firmware may catch Exception."""


class Reset(BaseException):
    """Ends the program because the microcontroller restarts, after machine.reset() or because of the watchdog."""


def to_us(seconds):
    return round(seconds * 1e6)


class Clock:
    """The board's clock. Models read now_us and schedule calls with at(). Operations that take time call advance().

    now_us: the time since the clock was created.
    next_us: time of the next deadline, event or comparison with the host's clock. Until then advance() only adds to
        now_us.
    pace: simulated seconds per second of the host. 1.0 is real time, 0 is as fast as possible.
    """

    def __init__(self, pace=0.0):
        self.now_us = 0
        self._events = []  # heap of (due, number, callable); the number orders events of the same time
        self._number = 0
        self._deadline_us = NEVER_US
        self._reset = False
        self.next_us = NEVER_US
        self._pace = 0
        self._pace_us = NEVER_US
        self._host_lead_us = 0
        self.set_pace(pace)

    def advance(self, us):
        """Advance the time and run the scheduled events. Raises PowerOff at the deadline, and exceptions of events."""
        target = self.now_us + us
        if target < self.next_us:
            self.now_us = target
        else:
            self._advance_to(target)

    def at(self, due_us, function):
        """Call function() at due_us, or at the next advance() if that time has passed."""
        self._number += 1
        heappush(self._events, (due_us, self._number, function))
        self._plan()

    def every(self, period_us, function):
        """Call function() every period_us from now on."""

        def again():
            self.at(self.now_us + period_us, again)
            function()

        self.at(self.now_us + period_us, again)

    def set_deadline(self, due_us):
        """Make advance() raise PowerOff at each call from due_us on. None: never."""
        self._deadline_us = NEVER_US if due_us is None else due_us
        self._reset = False
        self._plan()

    def reset(self):
        """Raise Reset now, and again at each advance() until the next set_deadline(), because firmware may catch it."""
        self._reset = True
        self._plan()
        raise Reset

    def power_off(self):
        """Raise PowerOff now, and again at each advance(), as reset() does."""
        self.set_deadline(self.now_us)
        raise PowerOff

    def set_pace(self, pace):
        self._pace = pace
        self._pace_us = self.now_us if pace else NEVER_US
        self._host_lead_us = _host_us() - self._host_due_us() if pace else 0
        self._plan()

    def _plan(self):
        due = min(self._deadline_us, self._pace_us) if not self._reset else 0
        if self._events and self._events[0][_DUE_US] < due:
            due = self._events[0][_DUE_US]
        self.next_us = due

    def _advance_to(self, target):
        """Advance to `target`, and do what is due until then: events, the deadline and the pace."""
        while self.next_us <= target:
            if self._reset:
                raise Reset
            if self.next_us > self.now_us:
                self.now_us = self.next_us
            if self._events and self._events[0][_DUE_US] <= self.now_us:
                function = heappop(self._events)[_FUNCTION]
                self._plan()
                function()
            elif self.now_us >= self._deadline_us:
                raise PowerOff
            else:
                self._keep_pace()
        if target > self.now_us:  # an event may also have called advance()
            self.now_us = target

    def _host_due_us(self):
        return int(self.now_us / self._pace)

    def _keep_pace(self):
        late = _host_us() - self._host_lead_us - self._host_due_us()
        if late < 0:
            _host_sleep(min(-late, 4 * _PACE_STEP_US) / 1e6)  # a short sleep, because the host's clock may be set
        else:  # after a slow phase of the host, do not run faster to catch up
            self._host_lead_us += late
        self._pace_us = self.now_us + _PACE_STEP_US
        self._plan()


class Watchdog:
    """A watchdog. If the watchdog is not fed in time, the call that advances the time raises Reset. clock: a Clock."""

    def __init__(self, clock):
        self._clock = clock
        self._timeout_us = 0
        self._due_us = 0
        self._round = 0  # counts start() and stop(), to ignore checks that an earlier start() has scheduled

    def start(self, timeout_us):
        """Start the watchdog. From now on feed() must be called at least every timeout_us."""
        self._timeout_us = timeout_us
        self._round += 1
        self.feed()
        self._check_later(self._round)

    def stop(self):
        self._round += 1

    def feed(self):
        self._due_us = self._clock.now_us + self._timeout_us

    def _check_later(self, number):
        def check():
            if number == self._round:
                if self._clock.now_us >= self._due_us:
                    self._clock.reset()
                self._check_later(number)

        self._clock.at(self._due_us, check)
