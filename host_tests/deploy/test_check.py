"""`kickstand check` on the simulated board: good boards pass, and each planted defect is named."""

import contextlib
from types import SimpleNamespace

import pytest
from kickstand_sim.simulated_board.i2c import OPEN, Registers
from kickstand_sim.simulated_board.mpu6050 import FIFO_COUNTH, FIFO_COUNTL, Fifo
from kickstand_tools.common.messages import InputError
from kickstand_tools.deploy import check
from support import command
from support.checked_board import CheckedBoard, part

PWR_MGMT_2, WHO_AM_I = 0x6C, 0x75
REST = part(4, share=0.3)


@pytest.fixture
def short(monkeypatch):
    """Repeat the measurements less often. The check judges only shares and figures per second."""
    for name, value in (("TRANSFERS", 2000), ("NOISE_S", 2), ("CLOCK_S", 3), ("LOOP_S", 3), ("TEXTS", 8)):
        monkeypatch.setattr(check, name, value)


def faults(checked, folder):
    return {finding.what: finding.line for finding in checked.findings(folder) if finding.verdict != check.GOOD}


@pytest.mark.parametrize(
    ("seed", "settings"),
    [
        (1, {}),
        *(pytest.param(seed, {"SAMPLE_HZ": hz, "DLPF": 4}, marks=pytest.mark.long)
          for seed, hz in ((2, 200), (3, 100), (4, 50), (5, 125))),
    ],
)  # fmt: skip
def test_good_boards_are_good(seed, settings, tmp_path):
    assert faults(CheckedBoard(part(seed), settings), tmp_path) == {}


@pytest.mark.parametrize("kind", ["ssd1306", pytest.param("sh1106", marks=pytest.mark.long)])
def test_related_chip_skips_the_self_test(kind, short, tmp_path):
    findings = faults(CheckedBoard(REST, who_am_i=0x70, display=kind), tmp_path)
    assert list(findings) == ["self-test"] and "only an MPU6050 (0x68)" in findings["self-test"]


# Defects that are planted in a board


def changed(axis, change):
    """Return world(t_s) of a sensor at rest whose reading on one of its six axes is change(reading, t_s)."""

    def world(t_s):
        values = list(REST(t_s))
        values[axis] = change(values[axis], t_s)
        return tuple(values)

    return world


def noise(size):
    return lambda value, t_s: value + size * (int(t_s * 1e4) * 2654435761 % 65536 / 65536 - 0.5)


def model(**attributes):
    """Return a function that changes attributes of the sensor's model."""
    return lambda board: [setattr(board.sensor, name, value) for name, value in attributes.items()]


def answered(change):
    """Return a function that lets the sensor answer change(register, value, number of the answer)."""

    def plant(board):
        sensor, read, counts = board.sensor, board.sensor.read_byte, {}

        def read_byte():
            register, value = vars(sensor)["_pointer"], read()
            counts[register] = counts.get(register, 0) + 1
            return change(register, value, counts[register])

        sensor.read_byte = read_byte

    return plant


def some_nacks(device, every):
    def plant(board):
        chip, numbers = getattr(board, device), iter(range(1, 10**9))
        start = chip.start
        chip.start = lambda address, read: next(numbers) % every != 0 and start(address, read)

    return plant


def replaced_by(device):
    def plant(board):
        board.remove_sensor()
        board.sensor_bus.attach(device(board))

    return plant


def faulty(name, *events):
    return lambda board: [getattr(board.faults, name)(*event) for event in events]


DEFECTS = {
    "gyro x dead": ("noise, gyro x", changed(3, lambda value, t_s: 0.5), None),
    "gyro y noisy": ("noise, gyro y", changed(4, noise(1.0)), None),
    "gyro z biased": ("bias, gyro z", changed(5, lambda value, t_s: value + 45), None),
    "accelerometer off": ("bias, accelerometer", changed(2, lambda value, t_s: value + 0.6), None),
    "hot": ("temperature", lambda t_s: (*REST(t_s)[:6], 95.0), None),
    "sample clock": ("sample clock", REST, model(clock_error=0.05)),
    "FIFO stays full": ("FIFO", REST, answered(lambda at, value, n: {FIFO_COUNTH: 4, FIFO_COUNTL: 0}.get(at, value))),
    "FIFO of half the size": ("FIFO under load", REST, model(fifo=Fifo(512))),
    "transfers fail": ("I2C errors", REST, some_nacks("sensor", 150)),
    "wrong answers": ("I2C errors", REST, answered(lambda at, value, n: value ^ 16 * (at == 0x75 and n % 300 == 0))),
    "standby": ("sensor", REST, answered(lambda at, value, n: 0x07 if at == PWR_MGMT_2 else value)),
    "no sensor": ("sensor", REST, lambda board: board.remove_sensor()),
    "another chip": ("sensor", REST, replaced_by(lambda board: Registers(0x68, {WHO_AM_I: 0x47}))),
    "an open wire": ("sensor", REST, lambda board: setattr(board.sensor_bus, "sda_wire", OPEN)),
    "drop-outs": ("sensor while running", REST, faulty("nack_for", *((0x68, 3 + k, 0.06) for k in range(60)))),
    "no display": ("display", REST, lambda board: board.remove_lcd()),
    "a display with a bad contact": ("display", REST, some_nacks("lcd", 40)),
    "button stuck": ("button", REST, lambda board: setattr(board.button, "closed", True)),
    "slow flash": ("flash", REST, faulty("slow_flash", (0, 1e6, 0.6))),
    "busy": ("longest turn", REST, faulty("busy", *((5 + k, 0.25) for k in range(80)))),
}  # fmt: skip
OFTEN = ("gyro x dead", "gyro y noisy", "gyro z biased", "FIFO of half the size", "transfers fail", "standby",
         "another chip", "no sensor", "drop-outs", "no display", "button stuck", "slow flash", "busy")  # fmt: skip


@pytest.mark.parametrize(
    "name", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.long) for name in DEFECTS]
)
def test_each_planted_defect_is_found_by_its_name(name, short, tmp_path):
    finding, world, plant = DEFECTS[name]
    checked = CheckedBoard(world)
    if plant:
        plant(checked.board)
    findings = faults(checked, tmp_path)
    assert finding == next(iter(findings), None) or (finding in findings and name == "drop-outs"), findings


@pytest.mark.parametrize(
    ("fitted", "free_bytes", "what", "words"),
    [
        ({"presses": []}, 90_000, "button", "no press"),
        ({"presses": [(1, 100)]}, 90_000, "button", "not released"),
        ({}, 9000, "memory", "do less in user.py"),
    ],
)
def test_button_and_memory_are_checked(fitted, free_bytes, what, words, short, tmp_path):
    checked = CheckedBoard(REST, **fitted)
    checked.free_bytes = free_bytes
    findings = faults(checked, tmp_path)
    assert list(findings) == [what] and words in findings[what]


def test_clock_is_not_measured_if_the_samples_stop_before_its_end(short, tmp_path):
    checked, times_us = CheckedBoard(REST), []

    def stop(register, value, _):
        if register not in (FIFO_COUNTH, FIFO_COUNTL) or "temperature" not in checked.said[-1]:
            return value
        times_us.append(checked.board.clock.now_us)  # the temperature's finding comes just before the clock's
        return value if times_us[-1] - times_us[0] < 1e6 * check.CLOCK_S - 100_000 else 0

    answered(stop)(checked.board)
    findings = faults(checked, tmp_path)
    assert list(findings) == ["sample clock"] and "the samples stopped" in findings["sample clock"]


# The command


@pytest.mark.parametrize("good", [True, False])
def test_check_prints_findings_and_a_verdict(good, short, tmp_path, monkeypatch):
    """The printed text is complete enough for an issue. The exit status is 1 if something is wrong."""
    checked = CheckedBoard(REST, {"SPEED": "gps"}, [(1, 0.2)])
    if good:
        checked.board.fit_gps(lambda t_s: 5.0)
    programs, results = [], []

    def run(ask):
        transport = SimpleNamespace(
            exec=lambda code: b"('micropython', '1.26.1', 'Pico')",
            exec_raw=lambda code, timeout: (ask(code).encode(), b""),
            exec_raw_no_follow=programs.append,
            wait=lambda seconds: None,
        )
        monkeypatch.setattr(check, "connected", lambda port: contextlib.nullcontext((transport, "P")))
        results.append(command.run("check"))

    checked.run(tmp_path, run)
    (result,) = results
    assert (result.status, result.err) == (0 if good else 1, "") and "machine.reset()" in programs[-1]
    *lines, verdict = result.out.splitlines()
    assert "Press the push button once, within 30 s" in lines.pop(2)
    assert {text[:4].strip() for text in lines} <= {check.GOOD, check.BAD}
    names = [text[5:34].strip() for text in lines]
    assert names[:4] == ["board", "machine code", "button", "sensor"] and names[-1] == "memory"
    assert verdict == ("all 31 are as they should be" if good else "1 of 31 are not as they should be: speed source")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        ("ImportError: no module named 'kickstand'", "Kickstand is not on the board at P"),
        ("SettingsError: ('not-allowed', 'DLPF', 9)", "P: config.py cannot be used: kickstand status says why"),
        ("MemoryError: ", "cannot be checked"),
    ],
)
def test_board_that_cannot_be_checked_is_refused(port, error, words):
    port.answers = [(b"('micropython', '1.26.1', 'Pico')", b""), (b"", error.encode()), (b"", b"")]
    with pytest.raises(InputError, match=words):
        check.check("P")
    assert b"machine.reset()" in port.programs[-1]
