"""Tests `kickstand check` on the simulated board: good boards pass, and each simulated defect is named."""

import contextlib

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import check, check_limits
from kickstand_tools.simulated_board.i2c import OPEN
from kickstand_tools.simulated_board.mpu6050 import FIFO_COUNTH, FIFO_COUNTL, PWR_MGMT_1, Fifo
from kickstand_tools.simulated_board.other_devices import Ds3231, Registers
from support import command
from support.checked_board import CheckedBoard, part

PWR_MGMT_2 = 0x6C
REST = part(4, share=0.3)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Repeat the measurements less often. The check judges only shares and figures per second."""
    for name, value in (("TRANSFERS", 2000), ("NOISE_S", 2), ("CLOCK_S", 3), ("LOOP_S", 3), ("TEXTS", 8)):
        monkeypatch.setattr(check, name, value)


def faults(checked, tmp_path):
    return {one.what: check.line(one) for one in checked.findings(tmp_path) if one.verdict != check.GOOD}


def test_a_good_board_is_good(tmp_path, monkeypatch):
    """Run the complete check once, as on a board."""
    monkeypatch.undo()
    assert faults(CheckedBoard(part(1)), tmp_path) == {}


@pytest.mark.parametrize("seed", range(2, 6))
@pytest.mark.parametrize("port", ["rp2"])
def test_other_good_boards_are_good(seed, port, tmp_path):
    assert faults(CheckedBoard(part(seed), {"SAMPLE_HZ": (200, 100, 50, 125)[seed - 2], "DLPF": 4}), tmp_path) == {}


@pytest.mark.parametrize("kind", ["ssd1306", "sh1106"])
def test_related_chip_skips_the_self_test(kind, tmp_path):
    found = faults(CheckedBoard(REST, who_am_i=0x70, display=kind), tmp_path)
    assert set(found) == {"self-test"} and "--" in found["self-test"]


def changed(axis, change):
    """Return a function world(t_s) for a sensor whose reading is changed on one of its six axes.

    change: a function of the reading and the time that returns the changed reading.
    """

    def world(t_s):
        values = list(REST(t_s))
        values[axis] = change(values[axis], t_s)
        return tuple(values)

    return world


def noisier(factor):
    def change(value, t_s):
        hashed = int(t_s * 1e4) * 2654435761 % 65536 / 65536 - 0.5
        return value + factor * hashed

    return change


def patched(name, value):
    """Return a function plant(board) that sets an attribute of the sensor's model."""
    return lambda board: setattr(board.sensor, name, value)


def always_full(board):
    sensor, read = board.sensor, board.sensor.read_byte

    def read_byte():
        register, value = sensor._pointer, read()
        return {FIFO_COUNTH: 4, FIFO_COUNTL: 0}.get(register, value)

    sensor.read_byte = read_byte


def some_nacks(part_name, every):
    def plant(board):
        device, count = getattr(board, part_name), [0]
        start = device.start

        def started(address, read):
            count[0] += 1
            return count[0] % every != 0 and start(address, read)

        device.start = started

    return plant


def wrong_bits(board):
    sensor, read, count = board.sensor, board.sensor.read_byte, [0]

    def read_byte():
        register, value = sensor._pointer, read()
        count[0] += register == 0x75
        return value ^ 0x10 if register == 0x75 and count[0] % 300 == 299 else value

    sensor.read_byte = read_byte


def standby(board):
    board.sensor._write = lambda register, value, write=board.sensor._write: write(
        register, 0x07 if register == PWR_MGMT_2 else value
    )
    power_on = board.sensor.power_on

    def on():
        power_on()
        board.sensor._regs[PWR_MGMT_2] = 0x07

    board.sensor.power_on = on


def asleep(board):
    board.sensor._write = lambda register, value, write=board.sensor._write: write(
        register, value | 0x40 if register == PWR_MGMT_1 else value
    )


def instead(device):
    def plant(board):
        board.remove_sensor()
        board.sensor_bus.attach(device(board))

    return plant


def stuck_button(board):
    board.button.closed = True


def drop_outs(board):
    for k in range(60):
        board.faults.nack_for(0x68, 3 + k, 0.06)


def busy(board):
    for k in range(80):
        board.faults.busy(5 + k, 0.25)


PLANTED = {
    "gyro x dead": (changed(3, lambda value, t_s: 0.5), None, "noise, gyro x"),
    "gyro z dead": (changed(5, lambda value, t_s: 0.0), None, "noise, gyro z"),
    "accelerometer z dead": (changed(2, lambda value, t_s: 0.75), None, "noise, accelerometer z"),
    "gyro y noisy": (changed(4, noisier(1.0)), None, "noise, gyro y"),
    "accelerometer x noisy": (changed(0, noisier(0.1)), None, "noise, accelerometer x"),
    "gyro z biased": (changed(5, lambda value, t_s: value + 45), None, "bias, gyro z"),
    "gyro x beyond the sheet": (changed(3, lambda value, t_s: value + 27), None, "bias, gyro x"),
    "accelerometer off": (changed(2, lambda value, t_s: value + 0.6), None, "bias, accelerometer"),
    "hot": (lambda t_s: (*REST(t_s)[:6], 95.0), None, "temperature"),
    "self-test of gyro y": (None, patched("self_test", [1, 1, 1, 1, 0.7, 1]), "self-test, gyro y"),
    "self-test of accelerometer x": (None, patched("self_test", [1.3, 1, 1, 1, 1, 1]), "self-test, accelerometer x"),
    "sample clock": (None, patched("clock_error", 0.05), "sample clock"),
    "FIFO stays empty": (None, patched("_queue", lambda: None), "FIFO"),
    "FIFO stays full": (None, always_full, "FIFO"),
    "FIFO of half the size": (None, patched("fifo", Fifo(512)), "FIFO under load"),
    "transfers fail": (None, some_nacks("sensor", 150), "I2C errors"),
    "wrong answers": (None, wrong_bits, "I2C errors"),
    "standby": (None, standby, "sensor"),
    "asleep": (None, asleep, "sensor"),
    "no sensor": (None, lambda board: board.remove_sensor(), "sensor"),
    "a clock instead": (None, instead(lambda board: Ds3231(board.clock)), "sensor"),
    "another chip": (None, instead(lambda board: Registers(0x68, {0x75: 0x47})), "sensor"),
    "an open wire": (None, lambda board: setattr(board.sensor_bus, "sda_wire", OPEN), "sensor"),
    "drop-outs": (None, drop_outs, "sensor while running"),
    "no display": (None, lambda board: board.remove_lcd(), "display"),
    "a display with a bad contact": (None, some_nacks("lcd", 40), "display"),
    "button stuck": (None, stuck_button, "button"),
    "slow flash": (None, lambda board: board.faults.slow_flash(0, 1e6, 0.6), "flash"),
    "full flash": (None, lambda board: board.faults.disk_full(0, 1e6), "flash"),
    "busy": (None, busy, "longest turn"),
}


@pytest.mark.parametrize("name", PLANTED)
def test_each_planted_defect_is_found_by_its_name(name, tmp_path):
    world, plant, what = PLANTED[name]
    checked = CheckedBoard(world or REST)
    if plant:
        plant(checked.board)
    found = faults(checked, tmp_path)
    assert what == next(iter(found), None) or (what in found and name == "drop-outs"), found


@pytest.mark.parametrize(("presses", "words"), [([], "no press"), ([(1, 100)], "not released")])
def test_broken_button_is_found(presses, words, tmp_path):
    found = faults(CheckedBoard(REST, presses=presses), tmp_path)
    assert list(found) == ["button"] and words in found["button"]


def test_little_memory_is_found(tmp_path):
    checked = CheckedBoard(REST)
    checked.free_bytes = 9000
    found = faults(checked, tmp_path)
    assert list(found) == ["memory"]


@pytest.mark.parametrize("good", [True, False])
def test_check_prints_findings_and_a_verdict(good, tmp_path, monkeypatch):
    """The printed text is complete enough for an issue. The exit status is 1 if something is wrong."""
    checked = CheckedBoard(REST, {"SPEED": "gps"}, [(1, 0.2)])
    if good:
        checked.board.fit_gps(lambda t_s: 5.0)
    results, restarted = [], []

    def run(ask):
        class Transport:
            def exec_raw(self, code, timeout):
                return ask(code).encode(), b""

        monkeypatch.setattr(check, "connected", lambda port: contextlib.nullcontext((Transport(), "a port")))
        monkeypatch.setattr(check, "describe", lambda transport, name: "")
        monkeypatch.setattr(check, "restart", restarted.append)
        results.append(command.run("check"))

    checked.run(tmp_path, run)
    (result,) = results
    assert (result.status, result.err, len(restarted)) == (0 if good else 1, "", 1)
    lines = result.out.split("\n")
    assert "Press the push button once" in lines[2]
    whats = [one.what for one in checks(lines)]
    assert {"board", "button", "sensor", "I2C errors", "FIFO under load", "longest turn", "memory"} <= set(whats)
    last = "all 31 are as they should be" if good else "1 of 31 are not as they should be: speed source"
    assert lines[-2] == last


def checks(lines):
    return [check.Finding(text[5:34].strip(), text[:4].strip(), text[34:]) for text in lines]


def test_board_without_firmware_or_good_config_is_refused():
    def failing(text):
        def ask(code):
            raise check.GuestFailed(text)

        return ask

    for text, words in (
        ("ImportError: no module named 'kickstand'", "Kickstand is not on the board at P"),
        ("SettingsError: ('not-allowed', 'DLPF', 9)", "config.py cannot be used"),
        ("MemoryError: ", "cannot be checked"),
    ):
        with pytest.raises(InputError, match=words):
            check.measured(failing(text), print, "P")


def test_invalid_measurements_are_refused():
    for said in ("", "()", "(1, 2)", "('a', 'b', 'c', 'd', 3, 4)", "nan", "{[}"):
        with pytest.raises(InputError, match="makes no sense"):
            check.measured(lambda code, said=said: said, lambda text: None)


def test_the_factory_trim_is_that_of_the_register_map():
    """The register map, RM-MPU-6000A rev 4.2, defines the factory trim on page 11. Code 1 means 0.34 g and 25 deg/s,
    code 31 means 0.92 g, and code 0 means that there is no factory trim."""
    ones = check_limits.factory_trims((0b000_00001, 0b000_00001, 0b000_00001, 0b01_01_01))
    assert ones == pytest.approx([1392.64] * 3 + [3275, -3275, 3275])
    most = check_limits.factory_trims((0xFF, 0xFF, 0xFF, 0x3F))
    assert most == pytest.approx([4096 * 0.92] * 3 + [3275 * 1.046**30, -3275 * 1.046**30, 3275 * 1.046**30])
    assert check_limits.factory_trims((0, 0, 0, 0)) == [0.0] * 6
    assert check_limits.self_test((0, 0, 0, 0), (0.0,) * 6, (1.0,) * 6)[0].verdict == check.SKIPPED
