"""The board's time: integer microseconds that pass only when something on the board takes time."""

import time as _host_time
from heapq import heappop, heappush

# Bound now: under MicroPython the board later puts its own `time` in place of this one
_host_ns, _host_sleep = _host_time.time_ns, _host_time.sleep

_NEVER = 1 << 60
_PACE_STEP_US = 5000  # how often a paced clock looks at the host's


def _host_us():
    return _host_ns() // 1000


class PowerOff(BaseException):
    """The supply is gone: ends whatever runs on the board. Not an Exception, which firmware might catch."""


class Reset(BaseException):
    """The microcontroller starts again: machine.reset(), or a watchdog that was not fed."""


def to_us(seconds):
    """Seconds to integer microseconds."""
    return round(seconds * 1e6)


class Clock:
    """now_us: the time, from 0. Models read it and schedule with at(); whatever takes time calls advance().

    pace: 1.0 runs in real time, 2.0 twice as fast, 0 as fast as the host can.
    """

    def __init__(self, pace=0.0):
        self.now_us = 0
        self._events = []  # heap of (due, number, callable): the number keeps equal times in order
        self._number = 0
        self._deadline_us = _NEVER
        self._next_us = _NEVER  # when advance() next has something to do
        self._pace = 0
        self._pace_us = _NEVER
        self._host_lead_us = 0
        self.set_pace(pace)

    def advance(self, us):
        """Let time pass, running what falls due. Raises PowerOff at the deadline, and what events raise."""
        target = self.now_us + us
        if target < self._next_us:
            self.now_us = target
        else:
            self._pass_to(target)

    def at(self, due_us, function):
        """Call function() when the time is due_us; if that has passed, when time next passes."""
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
        """When PowerOff is raised, and raised again however long the code goes on; None: never."""
        self._deadline_us = _NEVER if due_us is None else due_us
        self._plan()

    def set_pace(self, pace):
        """See the class."""
        self._pace = pace
        self._pace_us = self.now_us if pace else _NEVER
        self._host_lead_us = _host_us() - self._host_due_us() if pace else 0
        self._plan()

    def _plan(self):
        due = min(self._deadline_us, self._pace_us)
        if self._events and self._events[0][0] < due:
            due = self._events[0][0]
        self._next_us = due

    def _pass_to(self, target):
        while self._next_us <= target:
            if self._next_us > self.now_us:
                self.now_us = self._next_us
            if self._events and self._events[0][0] <= self.now_us:
                function = heappop(self._events)[2]
                self._plan()
                function()
            elif self.now_us >= self._deadline_us:
                raise PowerOff
            else:
                self._keep_pace()
        if target > self.now_us:  # an event may have let time pass itself
            self.now_us = target

    def _host_due_us(self):
        return int(self.now_us / self._pace)

    def _keep_pace(self):
        late = _host_us() - self._host_lead_us - self._host_due_us()
        if late < 0:
            _host_sleep(min(-late, 4 * _PACE_STEP_US) / 1e6)  # never long, should the host's clock be set
        else:  # a slow host loses time once; it does not run fast afterwards to catch up
            self._host_lead_us += late
        self._pace_us = self.now_us + _PACE_STEP_US
        self._plan()
