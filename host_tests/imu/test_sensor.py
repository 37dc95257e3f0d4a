"""The class Sensor keeps the chip working, through faults of the simulated board. Also the bus, and Ctrl-C."""

import gc
import math
import re
import textwrap
import warnings
from typing import Any

import pytest
from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level, on_board, write

SENSOR = 0x68


def moving(t_s):
    """Return readings in which no two samples are equal."""
    waves = [math.sin(rate * t_s) for rate in (40, 77, 91, 60, 33, 51)]
    return 0.1 * waves[0], 0.02 * waves[1], 1 + 0.01 * waves[2], 5 * waves[3], 3 * waves[4], 4 * waves[5], 30.0


class Run:
    """The firmware's Sensor, read every 10 ms on a board.

    changes: (time in s, code of the fault or None, restarts) at each change.
    samples: (time in s, number of samples) of each pass with samples.
    """

    def __init__(self, fault, until_s=3.0, explain=None, check_ms=0, prepare_s=0.0, rate_hz=200, **board):
        self.changes, self.samples = [], []
        self.sensor: Any = None
        self.board = Board(moving, **board)

        def firmware():
            from time import sleep_us, ticks_ms  # type: ignore[attr-defined]

            from kickstand.board import port
            from kickstand.imu.mpu6050 import Mpu6050
            from kickstand.imu.sensor import Sensor

            sensor = Sensor(Mpu6050(None, rate_hz=rate_hz), lambda: port.open_i2c(0, 4, 5, 400_000), explain)
            self.sensor = sensor
            fault(self.board)
            while True:
                now_s = self.board.clock.now_us / 1e6
                if now_s < prepare_s:
                    sensor.prepare(ticks_ms())
                else:
                    samples = sensor.fetch(ticks_ms())
                    if samples:
                        self.samples.append((now_s, samples))
                if check_ms and round(1000 * now_s) % check_ms == 0:
                    sensor.check(ticks_ms())
                change = sensor.fault and sensor.fault.code, sensor.restarts
                if not self.changes or change != self.changes[-1][1:]:
                    self.changes.append((self.board.clock.now_us / 1e6, *change))
                sleep_us(10_000 - self.board.clock.now_us % 10_000)

        with self.board:
            assert self.board.run(firmware, until_s) == "off"

    def codes(self):
        """Return the codes of the fault one after another."""
        codes = [code for _, code, _ in self.changes]
        return [code for k, code in enumerate(codes) if k == 0 or code != codes[k - 1]]

    def since(self, code):
        return next(time_s for time_s, other, _ in self.changes if other == code)


STARTED = ["starting", None]


def asleep(board):
    board.at(1.0, lambda: write(board.sensor, 0x6B, 0x41))


@pytest.mark.parametrize(
    ("fault", "codes", "delay_s", "well_s"),
    [
        (lambda board: board.faults.nack_for(SENSOR, 0.995, 0.02), [], 0, 0),  # two failed transfers are tolerated
        (lambda board: board.faults.nack_for(SENSOR, 0.995, 0.03), ["sensor-lost"], 0.03, 1.3),
        (lambda board: board.faults.stuck_sda(0.995), ["sensor-lost"], 0.06, 1.3),
        (lambda board: board.faults.unplug_sensor(0.995, 1.0), ["sensor-lost", "no-sensor"], 0.03, 2.25),
        (lambda board: board.faults.all_zero(0.995, 1.0), ["sensor-frozen"], 0.02, 2.25),
        (lambda board: board.faults.all_ones(0.995, 1.0), ["sensor-frozen"], 0.02, 2.25),
        (asleep, ["sensor-silent"], 0.12, 1.35),
        (lambda board: board.faults.freeze(1.0, 1.0), ["sensor-silent"], 0.12, 2.3),
        (lambda board: board.faults.busy(1.0, 0.45), [], 0, 0),
        (lambda board: board.faults.busy(1.0, 0.6), ["readings-lost"], 0.61, 1.62),
    ],
)
def test_each_fault_is_reported_in_time_and_ends(fault, codes, delay_s, well_s):
    """At 1 s a fault begins. delay_s: the longest time until it is reported. well_s: the latest time of a sample."""
    run = Run(fault)
    assert run.codes() == STARTED + (codes and [*codes, None])
    if codes:
        assert 1.0 <= run.since(codes[0]) <= 1.0 + delay_s and run.changes[-1][0] <= well_s
        late = [time_s for time_s, _ in run.samples if time_s > run.since(codes[0])]
        assert late[0] == pytest.approx(run.changes[-1][0], abs=0.01)
    assert (run.changes[-1][2] + run.sensor.starts > 2) == bool(codes)
    assert run.samples[-1][0] > 2.98


def test_a_chip_without_contact_for_a_moment_is_read_on():
    """The FIFO of an MPU6050 holds the samples of 0.3 s. A drop-out of over 0.5 s is a gap."""
    run = Run(lambda board: board.faults.nack_for(SENSOR, 1.5, 0.3))
    assert run.changes[-1][0] < 1.86 and run.changes[-1][1:] == (None, 1) and run.sensor.starts == 2
    assert sum(samples for _, samples in run.samples) == pytest.approx(200 * (3.0 - run.samples[0][0]), abs=4)
    for fault, restarts in (
        (lambda board: board.faults.nack_for(SENSOR, 1.5, 0.45), 1),
        (lambda board: board.faults.nack_for(SENSOR, 1.5, 0.6), 2),
        (lambda board: board.faults.unplug_sensor(1.5, 0.1), 1),
        (lambda board: board.faults.supply_dip(1.55), 1),
    ):
        assert Run(fault, check_ms=100).changes[-1][1:] == (None, restarts)


@pytest.mark.parametrize("rate_hz", [50, 200])
def test_samples_of_another_range_are_a_gap(rate_hz):
    for at_s in 1.55, 1.56:
        run = Run(
            lambda board, s=at_s: board.at(s, lambda: write(board.sensor, 0x1C, 0)), check_ms=100, rate_hz=rate_hz
        )
        assert run.changes[-1][1:] == (None, 2)


@pytest.mark.parametrize("leaves", ["asleep", "frozen", "default_ranges", "torn"])
def test_a_chip_that_has_reset_itself_is_set_up_again(leaves):
    """check() finds it at once. After a lost transfer it finds nothing, because a restart may be incomplete."""
    run = Run(lambda board: board.faults.supply_dip(0.995, leaves), check_ms=100)
    assert run.codes() == [*STARTED, "sensor-reset", None]
    assert run.since("sensor-reset") == pytest.approx(1.0, abs=0.002) and run.changes[-1][0] < 1.25


def test_a_start_takes_0_2_s_and_a_prepared_chip_has_no_old_samples():
    run = Run(lambda board: None, until_s=1.0)
    assert [change[1:] for change in run.changes] == [("starting", 0), ("starting", 1), (None, 1)]
    assert 0.18 <= run.changes[2][0] < 0.2 and run.samples[0][1] <= 2
    assert {count for _, count in run.samples[1:]} <= {1, 2, 3}
    prepared = Run(lambda board: None, until_s=2.0, prepare_s=1.0)
    assert prepared.samples[0] == (pytest.approx(1.01), pytest.approx(2, abs=1)) and prepared.changes[-1][2] == 1


@pytest.mark.parametrize(
    ("board", "code"), [({"sensor_address": None}, "no-sensor"), ({"who_am_i": 0x55}, "unknown-chip")]
)
def test_a_missing_or_unknown_chip_is_looked_for_every_50_ms(board, code):
    """The fault stays until the first sample of a chip that is fitted later."""

    def fit(board):
        def exchange():
            vars(board.sensor).update(who_am_i=0x68)
            board.fit_sensor()

        board.at(1.02, exchange)

    run = Run(fit, **board)
    assert [code for code in run.codes() if code != "starting"] == [code, None] and run.changes[0][0] < 0.01
    assert 1.2 < run.changes[-1][0] < 1.29 and run.changes[-1][2] == 1


def test_clipped_samples_are_skipped_and_a_faulty_axis_gives_none():
    def overdriven(board):
        def world(t_s):
            return (*moving(t_s)[:4], 900.0, *moving(t_s)[5:]) if 1.0 <= t_s < 4.0 else moving(t_s)

        vars(board.sensor).update(world=world)

    run = Run(overdriven, 8.0)
    assert run.codes() == [*STARTED, "clips", "axis-ill", None] and 500 < run.sensor.clock.skipped < 620
    assert not [time_s for time_s, _ in run.samples if 1.02 < time_s < 4.0]
    assert run.changes[-1][2] - run.changes[1][2] >= 1  # a faulty axis is a gap


def test_the_example_in_the_drivers_docstring_runs(capsys):
    """The example runs for a second. It prints the chip's name and temperature, then about 200 samples."""
    with Board(lambda t_s: (0.25, -0.5, 1.0, 10.0, -20.0, 30.0, 30.0)) as board:
        from kickstand.imu import mpu6050

        example = re.search(r"\n\n((?:    .*\n|\n)+)", mpu6050.__doc__ or "")
        assert example
        assert board.run(lambda: exec(textwrap.dedent(example[1]), {}), 1.3) == "off"
    first, *samples = capsys.readouterr().out.splitlines()
    assert first.startswith("MPU6050 30.") and 190 < len(samples) < 260 and samples[-1] == "[0.25, -0.5, 1.0] g"


def test_a_stuck_bus_is_freed_and_a_dead_one_is_reported():
    """A device that stopped in the middle of a byte needs up to nine clock pulses (NXP UM10204, 3.1.16)."""

    def program(board):
        from kickstand.board import port

        for bits, freed in ((1, True), (8, True), (9, True), (1000, False)):
            board.sensor_bus.hang(bits)
            assert port.free(4, 5) == freed, bits
        with pytest.raises(OSError, match="SDA is held low"):
            port.open_i2c(0, 4, 5, 400_000)

    assert on_board(program)[0] == "returned"


@pytest.mark.parametrize("gap_us", [None, 1, 300, 5000, 40_000])
def test_the_watchdog_stops_after_ctrl_c(gap_us, monkeypatch, tmp_path):
    """A watchdog that keeps running could reset the board while files are being copied, and the installation would be
    incomplete. A second Ctrl-C may come while a recording is being ended."""
    monkeypatch.chdir(tmp_path)

    def interrupt():
        raise KeyboardInterrupt

    def program(board):
        from time import sleep_ms  # type: ignore[attr-defined]

        from kickstand import app
        from kickstand.settings import Settings

        settings = Settings(type("Config", (), {"RECORD": True}))
        board.at(4.0, interrupt)
        if gap_us:
            board.clock.at(4_000_000 + gap_us, interrupt)
        try:
            app.App(settings, settings.open_lcd(), settings.open_sensor()).run()
        except KeyboardInterrupt:
            pass
        try:
            sleep_ms(20_000)
        except KeyboardInterrupt:
            sleep_ms(20_000)

    outcome = on_board(program, 100, world=level)[0]
    with warnings.catch_warnings():  # on a board the reset closes a file that the second Ctrl-C has left open
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()
    assert outcome == "returned"
