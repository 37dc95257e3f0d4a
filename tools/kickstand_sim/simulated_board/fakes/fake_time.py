"""MicroPython's `time` on the simulated board's clock.

On MicroPython this module replaces `time`. On CPython the names in ADDED are added to the real `time`.
"""

CALL_US = 5  # duration of reading the time, without which a loop that waits for a time would never end
_PERIOD = 1 << 30  # ticks_us() and ticks_ms() restart from 0 after this number, as on real boards
_HALF = _PERIOD // 2

# Names that CPython's time lacks
ADDED = ("ticks_us", "ticks_ms", "ticks_cpu", "ticks_add", "ticks_diff", "sleep_us", "sleep_ms")


def use(board_clock, at_zero_us):
    """Use this clock from now on. Ticks are 0 at its time at_zero_us."""
    global clock, zero_us
    clock = board_clock
    zero_us = at_zero_us


def ticks_us():
    clock.advance(CALL_US)
    return (clock.now_us - zero_us) & (_PERIOD - 1)


def ticks_ms():
    clock.advance(CALL_US)
    return (clock.now_us - zero_us) // 1000 & (_PERIOD - 1)


def ticks_cpu():
    return ticks_us()


def ticks_add(ticks, delta):
    return (ticks + delta) & (_PERIOD - 1)


def ticks_diff(end, start):
    return ((end - start + _HALF) & (_PERIOD - 1)) - _HALF


def sleep_us(us):
    clock.advance(us if us > 0 else CALL_US)


def sleep_ms(ms):
    sleep_us(ms * 1000)


def sleep(seconds):
    sleep_us(int(seconds * 1000000))


def time():
    return clock.now_us // 1000000
