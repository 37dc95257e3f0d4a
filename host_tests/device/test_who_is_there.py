"""The display and kickstand.status() report an unusable sensor and the devices on its bus."""

import io
from collections import Counter
from contextlib import redirect_stdout

import pytest
from kickstand_tools.simulated_board.i2c import LOW, OPEN
from kickstand_tools.simulated_board.other_devices import Ds3231, Registers
from kickstand_tools.simulated_board.simulator import Board


def still(_t_s):
    return (0, 1, 0, 0, 0, 0)


def noisy(t_s):
    a, b, c = (t_s * k % 1 for k in (977, 577, 433))  # in a working sensor the readings of every axis change
    return (0.01 * a, 1 + 0.01 * b, 0.01 * c, 0.5 * b, 0.5 * c, 0.5 * a)


def shown(tmp_path, monkeypatch, fit, world=noisy, until_s=4.0, config=None, **fitted):
    """Return the display's two lines at until_s. fit(board): a function that changes the board before power-on."""
    return shows(tmp_path, monkeypatch, fit, world, [until_s], config, **fitted)[0]


def shows(tmp_path, monkeypatch, fit, world, times_s, config=None, presses=(), **fitted):
    monkeypatch.chdir(tmp_path)
    seen = []
    board = Board(world, **fitted)
    fit(board)
    for at_s in times_s:
        board.at(at_s, lambda: seen.append(tuple(line.strip() for line in board.lcd.text())))
    for press in presses:
        board.press(*press)
    with board, redirect_stdout(io.StringIO()):
        from kickstand import settings, start

        monkeypatch.setattr(settings, "load", lambda: settings.Settings(type("Config", (), config or {})))
        board.run(start.main, times_s[-1] + 0.5)
    return seen


def status(tmp_path, monkeypatch, fit, world=noisy, config=None, **fitted):
    """Return the lines that kickstand.status() prints."""
    monkeypatch.chdir(tmp_path)
    board = Board(world, **fitted)
    fit(board)
    out = io.StringIO()
    with board, redirect_stdout(out):
        from kickstand import settings, status_report

        monkeypatch.setattr(status_report.gc, "mem_free", lambda: 0, raising=False)
        monkeypatch.setattr(status_report, "load", lambda: settings.Settings(type("Config", (), config or {})))
        board.run(status_report.report, 60)
    return out.getvalue().split("\n")


def instead(*devices):
    """Return fit(board), which replaces the sensor by these devices on the sensor's bus."""

    def fit(board):
        board.remove_sensor()
        for device in devices:
            board.sensor_bus.attach(device(board.clock) if device is Ds3231 else device)

    return fit


def beside(*devices):
    def fit(board):
        for device in devices:
            board.sensor_bus.attach(device(board.clock) if device is Ds3231 else device)

    return fit


def nothing_changed(board):
    pass


CHIPS = {
    "ICM-42688": (0x68, {0x75: 0x47}),
    "ICM-42605": (0x69, {0x75: 0x42}),
    "ICM-42670": (0x68, {0x75: 0x67}),
    "ICM-20948": (0x69, {0x00: 0xEA}),
    "BMI160": (0x69, {0x00: 0xD1}),
    "BMI270": (0x68, {0x00: 0x24}),
    "LSM6DS3": (0x6B, {0x0F: 0x69}),
    "LSM6DSO": (0x6A, {0x0F: 0x6C}),
    "QMI8658": (0x6B, {0x00: 0x05}),
    "ADXL345": (0x53, {0x00: 0xE5}),
}


@pytest.mark.parametrize("name", CHIPS)
def test_a_chip_of_another_family_is_named(name, tmp_path, monkeypatch):
    address, contents = CHIPS[name]
    fit = instead(Registers(address, contents))
    assert shown(tmp_path, monkeypatch, fit) == (name, "not supported")
    lines = status(tmp_path, monkeypatch, fit)
    assert f"Sensor       {name} at 0x{address:02x}: not supported" in lines[2]
    assert f"Sensor bus   SDA 4, SCL 5: 0x{address:02x} {name}" in lines


@pytest.mark.parametrize("number", [0x47, 0x75])
def test_a_chip_that_is_accepted_and_keeps_nothing(number, tmp_path, monkeypatch):
    """The display does not blame the wiring. The display names an ICM-42688, which has some of the settings in other
    registers."""
    fit = instead(Registers(0x68, {0x75: number}, range(0x4B, 0x77)))
    name = {0x47: ("ICM-42688", "not supported"), 0x75: ("Sensor keeps no", "settings: broken")}[number]
    config = {"ACCEPT_WHO_AM_I": number}
    seen = shows(tmp_path, monkeypatch, fit, noisy, [0.1 * k for k in range(1, 40)], config)
    assert seen[-1] == name
    assert all("wiring" not in second for _, second in seen)
    assert "wires are good" in "".join(status(tmp_path, monkeypatch, fit, config=config)) or number == 0x47


@pytest.mark.parametrize("mine", [0x68, 0x69])
def test_the_other_address_is_tried(mine, tmp_path, monkeypatch):
    there = 0x68 + 0x69 - mine
    config = {"SENSOR_ADDRESS": mine}
    for fit in (nothing_changed, beside(Ds3231) if there == 0x69 else nothing_changed):
        lines = shown(tmp_path, monkeypatch, fit, config=config, sensor_address=there)
        assert lines[0].startswith("Raw ")
        said = status(tmp_path, monkeypatch, fit, config=config, sensor_address=there)
        assert said[2].startswith("Sensor       MPU6050 (0x68), +-16 g")
        assert f"it answers at 0x{there:02x} and is used" in said[3]


def test_a_clock_that_has_the_sensors_address_is_not_set(tmp_path, monkeypatch):
    """The driver only reads from a device that is not the sensor. The driver writes nothing but the number of the
    register to read."""
    clocks = []

    def fit(board):
        board.remove_sensor()
        clocks.append(Ds3231(board.clock))
        board.sensor_bus.attach(clocks[-1])

    assert shown(tmp_path, monkeypatch, fit) == ("No sensor, but a", "clock 0x68")
    lines = status(tmp_path, monkeypatch, fit)
    assert "clock at 0x68" in lines[2] and "ACCEPT" not in "".join(lines)
    assert not clocks[0].written


@pytest.mark.parametrize("value", [0x00, 0xFF])
def test_nobody_is_advised_to_accept_an_empty_number(value, tmp_path, monkeypatch):
    fit = instead(Registers(0x68, dict.fromkeys(range(128), value)))
    assert shown(tmp_path, monkeypatch, fit) == ("No MPU6050: 0x68", f"answers 0x{value:02x}")
    lines = status(tmp_path, monkeypatch, fit)
    assert "not an MPU6050" in lines[2] and "ACCEPT" not in "".join(lines)
    refused = status(tmp_path, monkeypatch, fit, config={"ACCEPT_WHO_AM_I": value})
    assert "ACCEPT_WHO_AM_I" in refused[1]


def test_a_barometer_alone_is_no_sensor(tmp_path, monkeypatch):
    fit = instead(Registers(0x76, {0xD0 & 0x7F: 0x58}))
    assert shown(tmp_path, monkeypatch, fit) == ("No sensor, but a", "barometer 0x76")
    assert "none answers, but a barometer at 0x76" in status(tmp_path, monkeypatch, fit)[2]


def test_an_unknown_chip_is_named_with_its_number(tmp_path, monkeypatch):
    fit = instead(Registers(0x68, {0x75: 0x12, 0x6B: 0x41}))
    assert shown(tmp_path, monkeypatch, fit) == ("Unknown sensor", "WHO_AM_I 0x12")
    assert "ACCEPT_WHO_AM_I = 0x12" in status(tmp_path, monkeypatch, fit)[2]


@pytest.mark.parametrize("port", ["rp2", "esp32"])
def test_exchanged_wires_are_reported(port, tmp_path, monkeypatch):
    pins = {"rp2": (5, 4), "esp32": (22, 21)}[port]
    config = {} if port == "rp2" else {
        "SENSOR_SDA": 21, "SENSOR_SCL": 22, "LCD_SDA": 18, "LCD_SCL": 19, "BUTTON_PIN": 4
    }  # fmt: skip
    fitted = {"sensor_pins": pins, "port": port, "config": config}
    if port == "esp32":
        from kickstand.board import port as board_port

        monkeypatch.setattr(board_port, "IS_ESP32", True)
        monkeypatch.setattr(board_port, "turns_to_collect", lambda most: most)
    assert shown(tmp_path, monkeypatch, nothing_changed, **fitted) == ("SDA and SCL are", "exchanged")
    assert "SDA and SCL are exchanged" in status(tmp_path, monkeypatch, nothing_changed, **fitted)[2]


def never_fills(board):
    board.sensor._queue = lambda: None


def always_full(board):
    sensor, read = board.sensor, board.sensor.read_byte

    def read_byte():
        register, value = sensor._pointer, read()
        return {0x72: 4, 0x73: 0}.get(register, value)

    sensor.read_byte = read_byte


@pytest.mark.parametrize(("fit", "how"), [(never_fills, "stays empty"), (always_full, "stays full")])
def test_a_broken_fifo_stays_reported_and_presses_work(fit, how, tmp_path, monkeypatch):
    """The menu opens, although the firmware sets up the sensor again and again."""
    times = [3 + 0.1 * k for k in range(40)]
    seen = shows(tmp_path, monkeypatch, fit, noisy, [*times, 8.5], presses=[(7.5, 0.9)])
    assert {lines for lines in seen[:40] if "---" not in lines[1]} == {("Sensor: its FIFO", how)}
    assert "Align the bike" in seen[-1][0]
    assert f"its FIFO {how}" in "".join(status(tmp_path, monkeypatch, fit))


def wires(sda, scl):
    def fit(board):
        board.sensor_bus.sda_wire, board.sensor_bus.scl_wire = sda or "good", scl or "good"

    return fit


@pytest.mark.parametrize(
    ("sda", "scl", "lines", "said"),
    [
        (OPEN, OPEN, ("No sensor: wires", "open, no pull-up"), "SDA 4 and SCL 5 have no pull-up"),
        (OPEN, None, ("No sensor: open", "SDA, no pull-up"), "nothing pulls up SDA (GPIO 4)"),
        (None, OPEN, ("No sensor: open", "SCL, no pull-up"), "nothing pulls up SCL (GPIO 5)"),
        (LOW, None, ("SDA stays low", "check wiring"), "SDA (GPIO 4) stays low"),
        (None, LOW, ("SCL stays low", "check wiring"), "SCL (GPIO 5) stays low"),
    ],
)
def test_an_open_or_low_wire_is_reported(sda, scl, lines, said, tmp_path, monkeypatch):
    assert shown(tmp_path, monkeypatch, wires(sda, scl)) == lines
    assert said in status(tmp_path, monkeypatch, wires(sda, scl))[2]


def test_status_lists_both_buses(tmp_path, monkeypatch):
    lines = status(tmp_path, monkeypatch, beside(Registers(0x77)))
    assert "Sensor bus   SDA 4, SCL 5: 0x68 MPU6050, 0x77 barometer" in lines
    assert "Display bus  SDA 6, SCL 7: 0x27 display" in lines


def test_the_sensor_page_lists_the_devices(tmp_path, monkeypatch):
    """The page is the fourth entry of the menu if there is no speed source. A fault does not hide the menu."""
    fit = instead(Ds3231, Registers(0x57), Registers(0x77))
    presses = [(2.0, 1.0), (3.5,), (3.9,), (4.3,), (4.7, 1.0)]
    seen = shows(tmp_path, monkeypatch, fit, noisy, [6 + 0.5 * k for k in range(8)], presses=presses)
    assert {("No sensor, but a", "clock 0x68"), ("On its I2C bus:", "57 68 77")} <= set(seen)


@pytest.mark.parametrize("nth", range(1, 24, 2))
def test_a_nack_does_not_fail_the_set_up(nth, tmp_path, monkeypatch):
    def fit(board):
        board.faults.nack(0x68, nth)

    monkeypatch.chdir(tmp_path)
    board = Board(noisy)
    fit(board)
    with board:
        from kickstand.devices import open_sensor
        from kickstand.settings import Settings

        opened = open_sensor(Settings())
        assert board.run(opened.set_up, 1.0) == "returned"
        assert board.clock.now_us < 200_000


@pytest.mark.parametrize("wiring", [1, 2, 3, 4])
def test_status_finds_the_wiring_of_a_backpack(wiring, tmp_path, monkeypatch):
    """The board sends the number of each possible wiring with the wiring itself. Only the text of the right wiring is
    readable and lit."""
    monkeypatch.chdir(tmp_path)
    board = Board(noisy)
    setattr(board.lcd, "wiring", wiring)  # noqa: B010 - only Lcd has this attribute, not Oled
    seen = Counter()
    board.every(0.1, lambda: seen.update([(*board.lcd.text(), board.lcd.backlight)]))
    with board, redirect_stdout(io.StringIO()) as out:
        import kickstand
        from kickstand import status_report

        monkeypatch.setattr(status_report.gc, "mem_free", lambda: 0, raising=False)
        board.run(lambda: kickstand.status(True), 60)
    readable = [
        text[1].strip() for text, count in seen.items() if text[2] and text[0] == "This is readable" and count > 9
    ]
    assert readable == [f"LCD_WIRING = {wiring}"]
    assert f"LCD_WIRING = {wiring} is shown for 4 s" in out.getvalue()
