"""If the sensor cannot be used, the display and kickstand.status() name the cause: another chip, a wire, a broken
FIFO."""

from collections import Counter

import pytest
from kickstand_sim.simulated_board.i2c import LOW, OPEN, Ds3231, Registers
from kickstand_sim.simulated_board.mpu6050 import Fifo

WHO_AM_I, PWR_MGMT_1 = 0x75, 0x6B
BAROMETER, COMPASS, UNKNOWN = (0x77, {}), (0x1E, {}), (0x42, {})
LSM6DSO = (0x6A, {0x0F: 0x6C})
CLONE = {WHO_AM_I: 0x33, PWR_MGMT_1: 0x41}  # an unknown chip that looks like an MPU6050


def clock(board):
    return Ds3231(board.clock)


def connected(*devices, sensor=False):
    """Return fit(board), which connects devices to the sensor's bus. sensor: False to remove the sensor."""

    def fit(board):
        if not sensor:
            board.remove_sensor()
        for device in devices:
            board.sensor_bus.attach(device(board) if callable(device) else Registers(*device))

    return fit


def display(run, fit=None, **plan):
    record = run({"lean": [[0, 0]], "until": 3, **plan}, fit=fit)
    return tuple(line.strip() for line in record.last)


def other(name, address, contents, *writable):
    line = f"{name} at 0x{address:02x}: not supported"
    return [(address, contents, *writable)], (name, "not supported"), line


CAUSES = {
    "nothing": ([], ("No sensor", "check wiring"), "none answers on SDA 4, SCL 5: check these wires"),
    "display": ([(0x27, {}), UNKNOWN], ("No sensor", "check wiring"), "none answers on SDA 4"),
    "ICM-42688": other("ICM-42688", 0x68, {WHO_AM_I: 0x47}),
    "ICM-20948": other("ICM-20948", 0x69, {0x00: 0xEA}),
    "BMI270": other("BMI270", 0x68, {0x00: 0x24}),
    "LSM6DSO": other("LSM6DSO", *LSM6DSO),
    "QMI8658": other("QMI8658", 0x6B, {0x00: 0x05}),
    "ADXL345": other("ADXL345", 0x53, {0x00: 0xE5}),
    "barometer": ([BAROMETER], ("No sensor, but a", "barometer 0x77"), "none answers, but a barometer at 0x77"),
    "compass": ([COMPASS], ("No sensor, but a", "compass 0x1e"), "none answers, but a compass at 0x1e"),
    "clock": ([clock], ("No sensor, but a", "clock 0x68"), "none answers, but a clock at 0x68"),
    "chip, then barometer": ([BAROMETER, LSM6DSO], ("LSM6DSO", "not supported"), "LSM6DSO at 0x6a"),
    "zeros": ([(0x68, {})], ("No MPU6050: 0x68", "answers 0x00"), "not an MPU6050 (it reads 0x00)"),
    "unknown": ([BAROMETER, (0x68, CLONE)], ("Unknown sensor", "WHO_AM_I 0x33"), "set ACCEPT_WHO_AM_I = 0x33"),
}


@pytest.mark.parametrize("name", CAUSES)
def test_device_on_the_bus_is_named(name, run, status):
    devices, displayed, words = CAUSES[name]
    assert display(run, connected(*devices)) == displayed
    lines = status(fit=connected(*devices))
    (sensor,) = [line for line in lines if line.startswith("Sensor  ")]
    assert words in sensor and ("ACCEPT" in sensor) is (name == "unknown")
    assert "Calibration  not looked at: it belongs to a sensor" in lines
    assert not [line for line in lines if line.startswith(("Axes", "Reading"))]


def test_status_lists_the_devices_of_both_buses(status):
    lines = status(fit=connected(BAROMETER, UNKNOWN, sensor=True))
    assert "Sensor bus   SDA 4, SCL 5: 0x42, 0x68 MPU6050, 0x77 barometer" in lines
    assert "Display bus  SDA 6, SCL 7: 0x27 display" in lines
    assert "Sensor bus   SDA 4, SCL 5: nothing answers" in status(fit=connected())
    # The addresses below 0x08 and over 0x77 are reserved
    lines = status(fit=connected((0x07, {}), (0x08, {}), (0x78, {}), sensor=True))
    assert "Sensor bus   SDA 4, SCL 5: 0x08, 0x68 MPU6050" in lines


@pytest.mark.parametrize(
    ("fit", "fitted", "sensor", "display"),
    [
        (
            None,
            {"sensor_pins": (6, 7), "lcd_pins": (4, 5)},
            "0x68 on the wires of the display: connect it to SDA 4 and SCL 5",
            "0x27 on the wires of the sensor: connect it to SDA 6 and SCL 7",
        ),
        (connected(), {}, "none answers on SDA 4, SCL 5", "LCD at 0x27"),
    ],
    ids=["exchanged", "no sensor"],
)
def test_status_says_where_a_module_on_the_other_wires_belongs(fit, fitted, sensor, display, status):
    lines = status(fit=fit, **fitted)
    for label, words in (("Sensor ", sensor), ("Display ", display)):
        (text,) = [line for line in lines if line.startswith(label) and "bus" not in line[:13]]
        assert words in text


@pytest.mark.parametrize(
    ("who_am_i", "name"), [(0x70, "MPU6500"), (0x19, "MPU6886"), (0x12, "ICM20602"), (0x11, "ICM20600")]
)
def test_relative_of_the_mpu6050_works(who_am_i, name, run, status):
    assert display(run, lean=[[0, 25]], board={"who_am_i": who_am_i})[0].startswith("Raw   25°")
    assert status(who_am_i=who_am_i)[2].startswith(f"Sensor       {name} (0x{who_am_i:02x})")


def test_unknown_chip_works_if_it_is_accepted(run, status):
    plan = {"lean": [[0, 25]], "board": {"who_am_i": 0x75}}
    assert display(run, **plan) == ("Unknown sensor", "WHO_AM_I 0x75")
    assert display(run, **plan, config={"ACCEPT_WHO_AM_I": 0x75})[0].startswith("Raw   25°")
    assert "ACCEPT_WHO_AM_I" in status({"ACCEPT_WHO_AM_I": 0xFF})[1]  # no number that an empty bus gives


def test_clock_at_the_sensors_address_is_not_set(run):
    """The driver writes nothing to a device that is not the sensor, except the number of the register to read."""
    clocks = []

    def fit(board):
        clocks.append(Ds3231(board.clock))
        connected(lambda _: clocks[0])(board)

    display(run, fit)
    assert not clocks[0].written


@pytest.mark.parametrize(
    ("address", "fit"),
    [(0x68, None), (0x69, None), (0x69, connected(clock, sensor=True))],
    ids=["0x68", "0x69", "0x69 beside a clock"],
)
def test_sensor_at_the_other_address_is_used(address, fit, run, status):
    config = {"SENSOR_ADDRESS": 0x68 + 0x69 - address}
    assert display(run, fit, config=config, board={"sensor_address": address})[0].startswith("Raw ")
    lines = status(config, fit, sensor_address=address)
    assert lines[2].startswith("Sensor       MPU6050 (0x68), +-16 g")
    assert f"it answers at 0x{address:02x} and is used" in lines[3]


def wires(sda="good", scl="good"):
    def fit(board):
        board.sensor_bus.sda_wire, board.sensor_bus.scl_wire = sda, scl

    return fit


@pytest.mark.parametrize(
    ("fit", "shown", "words"),
    [
        (wires(OPEN, OPEN), ("No sensor: wires", "open, no pull-up"), "SDA 4 and SCL 5 have no pull-up"),
        (wires(sda=OPEN), ("No sensor: open", "SDA, no pull-up"), "nothing pulls up SDA (GPIO 4)"),
        (wires(scl=OPEN), ("No sensor: open", "SCL, no pull-up"), "nothing pulls up SCL (GPIO 5)"),
        (wires(sda=LOW), ("SDA stays low", "check wiring"), "SDA (GPIO 4) stays low"),
        (wires(scl=LOW), ("SCL stays low", "check wiring"), "SCL (GPIO 5) stays low"),
    ],
)
def test_open_or_low_wire_is_named(fit, shown, words, run, status):
    assert display(run, fit) == shown
    assert words in status(fit=fit)[2]


@pytest.mark.parametrize("board", [{"sensor_pins": (5, 4)}, {"machine": "esp32", "sensor_pins": (22, 21)}])
def test_exchanged_wires_are_named(board, run, status):
    assert display(run, board=board) == ("SDA and SCL are", "exchanged")
    assert "SDA and SCL are exchanged" in status(**board)[2]


def test_short_transfer_errors_do_not_delay_the_start(run):
    for nth in range(1, 24, 2):
        record = run({"lean": [[0, 25]], "faults": [["nack", [0x68, nth]]], "until": 1.0})
        assert record.last[0].startswith("Raw   25°") and record.first("No sensor") == float("inf"), nth


class NeverFills(Fifo):
    def push(self, data, keep_old=False):
        return False


class StaysFull(Fifo):
    @property
    def count(self):
        return 1024


@pytest.mark.parametrize(("fifo", "how"), [(NeverFills, "stays empty"), (StaysFull, "stays full")])
def test_broken_fifo_is_named(fifo, how, run, status):
    """The display names it again and again. Meanwhile the menu opens."""

    def fit(board):
        board.sensor.fifo = fifo(1024)

    assert f"Sensor       the sensor measures, but its FIFO {how}" in "\n".join(status(fit=fit))
    record = run({"presses": [[5.0, 0.9]], "until": 6.5}, fit=fit)
    assert record.at(4.9) == ["Sensor: its FIFO", f"{how:16}"]
    assert "Align the bike" in record.last[0]


@pytest.mark.parametrize("wiring", [1, 2, 3, 4])
def test_status_finds_the_wiring_of_a_backpack(wiring, status):
    """The board sends the number of each possible wiring with the wiring itself. Only the text of the right wiring is
    readable and lit."""
    counts = Counter()

    def fit(board):
        board.lcd.wiring = wiring
        board.every(0.1, lambda: counts.update([(*board.lcd.text(), board.lcd.backlight)]))

    lines = status(fit=fit, wirings=True)
    readable = [
        line2.strip()
        for (line1, line2, lit), count in counts.items()
        if lit and line1 == "This is readable" and count > 9
    ]
    assert readable == [f"LCD_WIRING = {wiring}"]
    assert f"             LCD_WIRING = {wiring} is shown for 4 s" in lines
