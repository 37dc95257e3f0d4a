"""Times the stages of the app's loop on the emulated Pico. bench_guest.py imports it only for a run with detail."""

from array import array
from time import ticks_diff, ticks_us

# Each entry: name of the stage, module, class, and method with its parameters.
STAGES = (
    ("decode and sum", "imu.mpu6050", "Mpu6050", "add_up(self, n)"),
    ("calibrate and rotate", "calibration.transform", "Transform", "apply_sum(self, sums, n, force, rate)"),
    ("filter", "lean.lean_filter", "LeanFilter", "update(self, force, rate, dt_us)"),
    ("meter", "lean.meter", "LeanMeter", "update_sum(self, sums, n, dt_us)"),
    ("fetch", "imu.sensor", "Sensor", "fetch(self, now_ms)"),
    ("page", "ui.screen", "Screen", "lines(self, now_ms)"),
    ("display", "board.display", "Display", "tick(self, now_ms)"),
)
WITHOUT_RESULT = ("apply_sum", "tick")  # methods that return nothing
BUS = len(STAGES)  # index of an additional column for the sensor's transfers
COLUMNS = BUS + 1

# The wrapper has no *arguments and few local variables, because these would use heap, and lengthen the allocations of
# the measured code.
_TIMED = """
def {name}({parameters}):
    begin({i})
    {result}function({parameters})
    end({i})
{back}
"""


class TimedBus:
    """An I2C bus that times its transfers."""

    def __init__(self, i2c, spent):
        self._i2c = i2c
        self._spent = spent

    def readfrom_mem_into(self, address, register, buffer):
        start = ticks_us()
        try:
            self._i2c.readfrom_mem_into(address, register, buffer)
        finally:
            self._spent[BUS] += ticks_diff(ticks_us(), start)

    def writeto_mem(self, address, register, buffer):
        start = ticks_us()
        try:
            self._i2c.writeto_mem(address, register, buffer)
        finally:
            self._spent[BUS] += ticks_diff(ticks_us(), start)


def time_stages(spent):
    """Make every call of a stage add its time in us to spent, at the stage's index in STAGES."""
    for i in range(BUS):
        _, module, of, method = STAGES[i]
        name = method.split("(")[0]
        owner = getattr(__import__("kickstand." + module, None, None, (module,)), of)
        setattr(owner, name, _timed(spent, getattr(owner, name), i, method, name not in WITHOUT_RESULT))


def stopwatch_us(spent):
    """Measure by how much a stopwatch lengthens a call, in us."""

    def function(self, n):
        pass

    took = []
    for call in (function, _timed(spent, function, 0, "timed(self, n)", True)):
        start = ticks_us()
        for _ in range(100):
            call(None, 0)
        took.append(ticks_diff(ticks_us(), start))
    return (took[1] - took[0]) // 100


def _timed(spent, function, i, signature, returns):
    """Return the function with a stopwatch that adds the time of each call to spent[i]."""
    starts = array("I", bytes(4 * BUS))

    def begin(i):
        starts[i] = ticks_us()

    def end(i):
        spent[i] += ticks_diff(ticks_us(), starts[i])

    name, parameters = signature[:-1].split("(")
    result, back = ("result = ", "    return result") if returns else ("", "")
    scope = {"function": function, "begin": begin, "end": end}
    exec(_TIMED.format(name=name, parameters=parameters, i=i, result=result, back=back), scope)
    return scope[name]
