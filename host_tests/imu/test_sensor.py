"""The class Sensor keeps the chip working. A class that the test controls replaces the chip."""

import pytest
from kickstand_tools.simulated_board.simulator import Board


@pytest.fixture(autouse=True)
def board():
    with Board(lambda t_s: (0, 0, 1, 0, 0, 0)) as made:
        yield made


class Chip:
    """A chip that the test controls.

    waiting: results of the next fetches, each a number of samples or an exception. Later fetches return one sample.
    bad: number of spoilt samples.
    setups: for each set-up the exception that its last step raises, or None.
    calls: list of the calls up to now.
    """

    def __init__(self):
        from kickstand.imu.fifo_frames import AxisWatch

        self.axes = AxisWatch(200, 3, 1, 3, 20)
        self.axes.notes[9] = 1 << 29  # let the next check of the axes never come
        self.waiting, self.setups, self.states = [], [], []
        self.bad = 0
        self.overflows = self.frames_left = 0
        self.calls = []

    def connect(self, i2c):
        self.calls.append(("connect", i2c))

    def configure(self):
        self.calls.append("configure")
        yield 100
        yield 60
        error = self.setups.pop(0) if self.setups else None
        if error:
            raise error
        yield 20

    def start(self):
        self.calls.append("start")

    def fetch(self):
        self.calls.append("fetch")
        return raised_or(self.waiting.pop(0)) if self.waiting else 1

    def add_up(self, n):
        return n - self.bad

    def restart_fifo(self):
        self.calls.append("restart_fifo")

    def configured(self):
        self.calls.append("configured")
        return raised_or(self.states.pop(0)) if self.states else True


def raised_or(value):
    if isinstance(value, Exception):
        raise value
    return value


def made(board, explain=None):
    from kickstand.imu.sensor import Sensor

    chip = Chip()
    return Sensor(chip, lambda: "bus", explain), chip


def set_up(sensor, now_ms):
    """Run loop passes of 10 ms from now_ms on until the chip is set up. Return the time of the last pass."""
    for _ in range(19):
        assert sensor.fetch(now_ms) == 0
        now_ms += 10
    return now_ms - 10


def running(board, explain=None):
    """Return a Sensor, its chip, which is running, and the time of the first sample in ms."""
    sensor, chip = made(board, explain)
    now_ms = set_up(sensor, 0)
    assert sensor.fetch(now_ms) == 1
    assert sensor.fault is None
    del chip.calls[:]
    return sensor, chip, now_ms


def code(sensor):
    return sensor.fault and sensor.fault.code


def test_a_new_chip_is_at_fault_until_its_first_sample(board):
    sensor, chip = made(board)
    assert code(sensor) == "starting"
    for now_ms in (0, 99, 100, 159, 160, 179):
        assert sensor.fetch(now_ms) == 0
        assert chip.calls == [("connect", "bus"), "configure"]
    assert sensor.fetch(180) == 0
    assert chip.calls == [("connect", "bus"), "configure", "start"]
    assert (sensor.restarts, code(sensor)) == (1, "starting")
    assert sensor.fetch(200) == 1
    assert code(sensor) is None


def test_a_chip_that_is_prepared_starts_with_the_first_fetch(board):
    """The chip was prepared earlier, but its FIFO starts only with the first fetch. So the FIFO never contains samples
    that are older than the first fetch."""
    sensor, chip = made(board)
    for now_ms in range(0, 1000, 15):
        sensor.prepare(now_ms)
    assert chip.calls == [("connect", "bus"), "configure"]
    assert sensor.fetch(1000) == 0
    assert chip.calls == [("connect", "bus"), "configure", "start"]
    assert sensor.fetch(1100) == 1


def test_a_failed_set_up_is_repeated_after_50_ms(board):
    from kickstand.imu.mpu6050 import UnknownChip

    sensor, chip = made(board)
    chip.setups = [OSError(5), UnknownChip(0x55), None]
    for now_ms in (0, 100, 160):
        sensor.fetch(now_ms)
    assert (code(sensor), sensor.restarts) == ("no-sensor", 0)
    sensor.fetch(209)
    assert chip.calls.count("configure") == 1
    for now_ms in (210, 310, 370):
        sensor.fetch(now_ms)
    assert sensor.fault and (sensor.fault.code, sensor.fault.values) == ("unknown-chip", (0x55,))
    for now_ms in (420, 520, 580, 600):
        sensor.fetch(now_ms)
    assert (chip.calls.count("configure"), sensor.restarts) == (3, 1)
    assert code(sensor) == "unknown-chip"  # the fault stays until the first sample
    sensor.fetch(605)
    assert code(sensor) is None


def test_silence_is_a_fault_after_100_ms(board):
    sensor, chip, now_ms = running(board)
    chip.waiting = [0, 0, 3, 0, 0, 0]
    for after_ms, samples, said in ((5, 0, None), (100, 0, None), (100, 3, None), (105, 0, None), (200, 0, None)):
        assert sensor.fetch(now_ms + after_ms) == samples
        assert code(sensor) == said
    assert sensor.fetch(now_ms + 201) == 0
    assert code(sensor) == "sensor-silent"


def test_an_overflow_is_no_silence(board):
    """After an overflow the driver empties the FIFO, so there are no samples for a moment. The sensor is not reported
    as silent, even if the loop read the time before the overflow."""
    sensor, chip, now_ms = running(board)
    board.clock.advance(now_ms * 1000 + 400_000)
    chip.waiting = [0, 0, 0]
    chip.overflows = 1
    assert sensor.fetch(now_ms + 390) == 0
    assert code(sensor) is None
    assert sensor.fetch(now_ms + 500) == 0
    assert code(sensor) is None
    assert sensor.fetch(now_ms + 502) == 0
    assert code(sensor) == "sensor-silent"


def test_half_a_second_of_lost_readings_is_a_fault(board):
    """The FIFO overflows again and again, because the board has no time to read it."""
    sensor, chip, now_ms = running(board)
    for after_ms, said in ((300, None), (500, None), (502, "readings-lost")):
        board.clock.advance(max(0, (now_ms + after_ms) * 1000 - board.clock.now_us))
        chip.waiting, chip.overflows = [0], chip.overflows + 1
        assert sensor.fetch(now_ms + after_ms) == 0
        assert code(sensor) == said
    assert sensor.restarts == 2  # the lost readings are a gap, which counts as a restart
    assert sensor.fetch(now_ms + 510) == 1
    assert code(sensor) is None


def test_two_lost_transfers_are_tolerated_and_three_are_a_fault(board):
    sensor, chip, now_ms = running(board)
    lost = OSError(5)
    chip.waiting = [lost, lost, 1, lost, lost, lost]
    said = []
    for k in range(6):
        samples = sensor.fetch(now_ms + 10 * k)
        assert samples == (1 if k == 2 else 0)
        said.append(code(sensor))
    assert said == [None] * 5 + ["sensor-lost"]


def test_the_fifo_is_emptied_after_a_failed_transfer(board):
    """The failed transfer may have read only a part of a frame. The FIFO is therefore emptied, but only once."""
    sensor, chip, now_ms = running(board)
    chip.waiting = [OSError(110), 1, 1]
    for k in range(3):
        sensor.fetch(now_ms + 10 * k)
    assert chip.calls == ["fetch", "restart_fifo", "fetch", "fetch"]


def test_a_chip_at_fault_is_set_up_at_once(board):
    sensor, chip, now_ms = running(board)
    chip.bad = 1
    sensor.fetch(now_ms + 50)
    assert code(sensor) == "sensor-frozen"
    chip.bad = 0
    assert set_up(sensor, now_ms + 50) == now_ms + 230
    assert chip.calls[-3:] == [("connect", "bus"), "configure", "start"]
    assert (sensor.restarts, code(sensor)) == (2, "sensor-frozen")
    assert sensor.fetch(now_ms + 300) == 1
    assert code(sensor) is None


def test_a_chip_that_has_reset_itself_is_set_up_again(board):
    sensor, chip, now_ms = running(board)
    chip.states = [True, False]
    sensor.check(now_ms + 100)
    assert code(sensor) is None
    sensor.check(now_ms + 200)
    assert code(sensor) == "sensor-reset"
    assert "configure" not in chip.calls
    assert sensor.fetch(now_ms + 200) == 0
    assert "configure" in chip.calls


def test_a_check_that_is_lost_counts_as_a_lost_transfer(board):
    sensor, chip, now_ms = running(board)
    chip.states = [OSError(5)]
    chip.waiting = [OSError(5)] * 2
    sensor.check(now_ms + 100)
    for k in (1, 2):
        assert code(sensor) is None
        sensor.fetch(now_ms + 100 + 10 * k)
    assert code(sensor) == "sensor-lost"


def test_nothing_is_judged_after_a_lost_transfer(board):
    """After a lost transfer the restart of the FIFO may be incomplete. The restart is completed after the next
    successful transfer, and only then is the chip judged again."""
    sensor, chip, now_ms = running(board)
    chip.waiting, chip.states = [OSError(5)], [False, False]
    sensor.fetch(now_ms + 10)
    sensor.check(now_ms + 10)
    assert (code(sensor), chip.states) == (None, [False, False])
    sensor.fetch(now_ms + 20)
    sensor.check(now_ms + 20)
    assert code(sensor) == "sensor-reset"


def until_failed(sensor, chip, now_ms, since_ms):
    """Let a running chip give no samples for since_ms. Return the time of the fault."""
    chip.waiting = [0] * 20
    sensor.fetch(now_ms + since_ms)
    return now_ms + since_ms


def test_the_fifo_is_tested_if_set_ups_do_not_help(board):
    """The test of the FIFO runs at the third fault in a row, if each fault comes soon after a set-up."""
    from kickstand.errors import Notice

    asked = []
    notice = Notice("sensor-fifo", "stays empty")
    sensor, chip, now_ms = running(board, lambda chip, error: asked.append(error) or (notice, []))
    said = []
    for _ in range(4):
        now_ms = until_failed(sensor, chip, now_ms, 150)
        said.append(code(sensor))
        now_ms = set_up(sensor, now_ms)
    assert said == ["sensor-silent", "sensor-silent", "sensor-fifo", "sensor-fifo"]
    assert asked == [None]  # the test of the FIFO runs only once, because it takes 0.3 s
    chip.waiting = []
    sensor.fetch(now_ms + 5)
    assert code(sensor) is None


def test_faults_far_apart_do_not_question_the_fifo(board):
    sensor, chip, now_ms = running(board, lambda chip, error: 1 / 0)
    for _ in range(5):
        now_ms = until_failed(sensor, chip, now_ms, 1500)
        assert code(sensor) == "sensor-silent"
        now_ms = set_up(sensor, now_ms)


def test_a_broken_fifo_explains_lost_readings(board):
    from kickstand.errors import Notice

    sensor, chip, now_ms = running(board, lambda chip, error: (Notice("sensor-fifo", "stays full"), []))
    board.clock.advance((now_ms + 600) * 1000 - board.clock.now_us)
    chip.waiting, chip.overflows = [0], 1
    sensor.fetch(now_ms + 600)
    assert code(sensor) == "sensor-fifo"


def test_failed_set_ups_are_explained_about_once_a_second(board):
    from kickstand.errors import Notice
    from kickstand.imu.sensor import Sensor

    chip, asked = Chip(), []
    chip.setups = [OSError(5)] * 60

    def explain(chip, error):
        asked.append(now_ms)
        return Notice("exchanged", 4, 5), [0x3C]

    sensor = Sensor(chip, lambda: "bus", explain)
    chip.configure = lambda: iter_failing()
    for now_ms in range(0, 3000, 10):
        sensor.fetch(now_ms)
        assert code(sensor) == ("exchanged" if asked else "starting")
    assert asked == [100, 1100, 2100]
    assert sensor.found == [0x3C]


def iter_failing():
    raise OSError(5)


def test_a_fifo_that_does_not_start_is_tried_again_with_the_bus(board):
    sensor, chip = made(board)
    broken = [OSError(5)]

    def start():
        if broken:
            raise broken.pop()

    chip.start = start
    for now_ms in (0, 100, 160, 180):
        assert sensor.fetch(now_ms) == 0
    assert (code(sensor), sensor.restarts) == ("no-sensor", 0)
    sensor.fetch(230)
    assert chip.calls == [("connect", "bus"), "configure"] * 2
