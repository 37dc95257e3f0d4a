"""`kickstand check` and `kickstand bench` on the emulated boards: each planted defect is named, and the loop, the start
and the heap stay within their limits."""

import pytest
from kickstand_tools.deploy import check
from kickstand_tools.simulated_board.mpu6050 import Fifo
from kickstand_tools.simulated_board.other_devices import Ds3231
from support.checked_board import part
from support.emulated import CHIPS, modules, pico

pytestmark = [pytest.mark.chip, pytest.mark.long]
REST = part(4, share=0.3)


def checked(chip, world=REST, plant=None, press=True, files=None, **fitted):
    """Run `kickstand check` on an emulated board. Return the bad findings as {what was checked: line}."""
    with CHIPS[chip](world, modules(chip) | (files or {}), **fitted) as device:
        if plant:
            plant(device.board)

        def say(text):
            if press and text.startswith("Press"):
                device.board.press(device.time_s + 0.5, 0.2)

        def ask(code):
            try:
                return device.exec(code, 150)
            except Exception as error:
                raise check.GuestFailed(str(error).strip().rpartition("\n")[2]) from error

        findings = check.measured(ask, say)
    return {finding.what: check.line(finding) for finding in findings if finding.verdict != check.GOOD}


@pytest.mark.parametrize("chip", ["pico"])
def test_a_good_board_is_good(chip):
    assert checked(chip) == {}


def spoilt(t_s):
    """Return the readings of a sensor with many defects. The accelerometer's x is dead and its y is noisy. The gyro's x
    is biased, its y is noisy and its z is dead. The chip is hot."""
    force, rate = list(REST(t_s)[:3]), list(REST(t_s)[3:6])
    hashed = int(t_s * 1e4) * 2654435761 % 65536 / 65536 - 0.5
    force[0] = 0.3
    force[1] += 0.1 * hashed
    return (*force, rate[0] + 45, rate[1] + hashed, 0.5, 70.0)


def many(board):
    board.sensor.self_test = [1, 1, 0.7, 1.3, 1, 1]
    board.sensor.clock_error = 0.05
    board.remove_lcd()


@pytest.mark.parametrize("chip", ["pico"])
def test_defects_of_many_parts_are_found_at_once(chip):
    bad = checked(chip, spoilt, many, press=False)
    wanted = {"noise, accelerometer x", "noise, accelerometer y", "noise, gyro y", "noise, gyro z", "bias, gyro x"}
    wanted |= {"temperature", "self-test, accelerometer z", "self-test, gyro x", "sample clock", "display", "button"}
    assert wanted <= set(bad), bad
    beside = {"self-test, accelerometer x", "self-test, gyro z", "sensor while running", "bias, accelerometer"}
    assert set(bad) - wanted <= beside | {"noise, gyro x"}, bad


def always_full(board):
    sensor, read = board.sensor, board.sensor.read_byte

    def read_byte():
        register, value = sensor._pointer, read()
        return {0x72: 4, 0x73: 0}.get(register, value)

    sensor.read_byte = read_byte
    sensor.read_into = lambda buf: [buf.__setitem__(i, read_byte()) for i in range(len(buf))]


def some_nacks(board):
    count, start = [0], board.sensor.start

    def started(address, read):
        count[0] += 1
        return count[0] % 150 != 0 and start(address, read)

    board.sensor.start = started


def a_clock(board):
    board.remove_sensor()
    board.sensor_bus.attach(Ds3231(board.clock))


def wrong_answers(board):
    sensor, read, count = board.sensor, board.sensor.read_byte, [0]

    def read_byte():
        register, value = sensor._pointer, read()
        count[0] += register == 0x75
        return value ^ 0x10 if register == 0x75 and count[0] % 300 == 299 else value

    sensor.read_byte = read_byte
    sensor.read_into = lambda buf: [buf.__setitem__(i, read_byte()) for i in range(len(buf))]


SLOW_USER = b"from time import sleep_ms\ndef on_lean(lean_deg, trusted, meter):\n    sleep_ms(190)\n"
PLANTED = {
    "FIFO stays empty": ("FIFO", {"plant": lambda board: setattr(board.sensor, "_queue", lambda: None)}),
    "FIFO stays full": ("FIFO", {"plant": always_full}),
    "FIFO of half the size": ("FIFO under load", {"plant": lambda board: setattr(board.sensor, "fifo", Fifo(512))}),
    "transfers fail": ("I2C errors", {"plant": some_nacks}),
    "wrong answers": ("I2C errors", {"plant": wrong_answers}),
    "no sensor": ("sensor", {"plant": lambda board: board.remove_sensor()}),
    "a clock instead": ("sensor", {"plant": a_clock}),
    "button stuck": ("button", {"plant": lambda board: setattr(board.button, "closed", True), "press": False}),
    "slow user.py": ("longest turn", {"files": {"/user.py": SLOW_USER}}),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_defect_that_hides_others_is_found_by_its_name(name):
    """Each board has one defect. The line of the defect comes first, before the lines of its consequences. Together
    with the eleven defects above, the tests plant twenty defects."""
    what, planted = PLANTED[name]
    bad = checked("pico", **planted)
    assert next(iter(bad), None) == what, bad


def test_the_loop_and_the_start_stay_within_their_limits():
    """No sample is lost, the heap does not shrink, and the first lean appears within 1.12 s."""
    pico()  # skips the test without the emulator
    from kickstand_workshop.bench import bench

    result = bench.loop(2)  # within only one second the number of garbage collections varies
    for spread in result["turn_us"], result["collection_pause_us"]:
        assert 0 < spread["median"] <= spread["p99"] <= spread["max"]
    assert result["samples_taken"] == pytest.approx(result["seconds"] * bench.SAMPLE_HZ, abs=2)
    assert result["samples_lost"] == 0
    assert 0.1 < result["cpu_share"] < 0.50
    assert result["free_heap_bytes"] > 120_000
    assert result["free_heap_at_end_bytes"] > result["free_heap_bytes"] - 4000
    start = bench.start("rp2040")
    assert 0 < start.micropython_s < 0.1
    assert 0.2 < start.starting_s < start.sampling_s < start.lean_s < 1.12
    assert 0.4 < sum(start.import_s.values()) < start.sampling_s
    assert "kickstand.lean.lean_filter" in start.import_s
