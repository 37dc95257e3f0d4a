"""The lines of kickstand.status() for settings, sensor, display, button, speed, memory and the last run."""

import re

import pytest
from support.board_access import rough


def line(lines, label):
    """Return the rest of the line that begins with this label."""
    (text,) = [text[13:] for text in lines if text[:13].strip() == label and text[:1] != " "]
    return text


def test_new_board(status):
    lines = status()
    assert lines[0].startswith("Kickstand 0.") and ", MicroPython " in lines[0]
    assert line(lines, "Settings") == "motorcycle, kickstand side left, 200 samples per second"
    sensor = line(lines, "Sensor")
    assert sensor.startswith("MPU6050 (0x68), +-16 g, +-500 deg/s, ") and sensor.endswith(" C")
    assert float(sensor.split(", ")[-1].split()[0]) == pytest.approx(31.0, abs=0.2)
    assert [float(text) for text in line(lines, "Reading").split()[:3]] == pytest.approx([0.5, 0.25, 0.75], abs=0.004)
    assert line(lines, "Axes") == "all six measure"
    assert line(lines, "Display") == "LCD at 0x27"
    assert line(lines, "Button") == "GPIO 15, not pressed"
    assert line(lines, "Speed").startswith("no source")
    assert line(lines, "Calibration").startswith("six positions: no, aligned: no; ")
    assert "  offset, g           0.0000    0.0000    0.0000" in lines
    assert "  slope               1.0000    1.0000    1.0000" in lines
    rows = [text.split()[1:] for text in lines if text.split()[0] in ("left", "up", "forward")]
    assert rows == [["1.0000", "0.0000", "0.0000"], ["0.0000", "1.0000", "0.0000"], ["0.0000", "0.0000", "1.0000"]]
    plain = "decode, add_up, products, encode"  # CPython has no machine code
    assert line(lines, "Machine code") == f"not used for {plain}: slower code runs instead"
    assert not [text for text in lines if text.startswith(("Sensor odd", "Since start", "Vibration"))]


def test_memory_and_the_time_to_write_flash(status, tmp_path):
    words = line(status(fit=lambda board: board.faults.slow_flash(0.0, 60.0, 0.037)), "Memory")
    assert re.fullmatch(r"117 KB free; flash \d+ KB free, 3[789] ms to write a block", words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("fitted", "label", "words"),
    [
        ({"display": "ssd1306"}, "Display", "OLED at 0x3c"),
        ({"lcd_address": None}, "Display", "none answers: check wiring and LCD_ADDRESSES"),
        ({"lcd_address": None}, "Display bus", "SDA 6, SCL 7: nothing answers"),
        ({"fit": lambda board: board.press(0.0, 60.0)}, "Button", "GPIO 15, pressed"),
        ({"world": lambda t_s: (*rough(t_s)[:4], 0.0, *rough(t_s)[5:])}, "Axes", "Gyro y dead, "),
        ({"config": {"BUTTON_PIN": 4}}, "Settings", "config.py: a pin is used twice among BUTTON_PIN, SENSOR_SDA"),
        ({"machine": "s3"}, "Settings", "config.py: no usual pins are known for this board"),
    ],
)
def test_part_has_its_line(fitted, label, words, status):
    assert line(status(**fitted), label).startswith(words)


GPS, WHEEL = {"SPEED": "gps"}, {"SPEED": "wheel", "PULSES_PER_METRE": 2}


def fitted(source, mps):
    return lambda board: getattr(board, "fit_" + source)(lambda t_s: mps)


@pytest.mark.parametrize(
    ("config", "fit", "name", "speed"),
    [
        (GPS, fitted("gps", 15.0), "GPS on UART 1, RX 9, 9600 baud:", "15.0 m/s"),
        (GPS, fitted("gps", 0.0), "GPS on UART 1, RX 9, 9600 baud:", "0.0 m/s"),
        (GPS, None, "GPS on UART 1, RX 9, 9600 baud:", "GPS silent, check wiring"),
        (WHEEL, fitted("wheel", 0.0), "wheel on GPIO 14, 2.00 pulses a metre:", "no pulse"),
        ({"SPEED": "wheel"}, fitted("wheel", 15.0), "wheel on GPIO 14, 0.50 pulses a metre:", "15.0 m/s"),
    ],
)
def test_speed_source_has_its_speed_or_fault(config, fit, name, speed, status):
    lines = status(config, fit)
    assert line(lines, "Speed") == name
    assert speed in lines[lines.index("Speed        " + name) + 1]


def test_last_run_has_its_worst_values(status):
    """Other code keeps the processor busy for 0.25 s, which fills half of the FIFO."""
    lines = status(fit=lambda board: board.faults.busy(2.0, 0.25), ride_s=4.0)
    words = re.fullmatch(
        r"longest turn ([\d.]+) ms; places left in the FIFO, at the fewest: (\d+)", line(lines, "Since start")
    )
    assert words
    assert 245.0 < float(words[1]) < 275.0 and 15 <= int(words[2]) <= 25
    assert line(lines, "Vibration") == (
        "largest force 0.5 0.3 0.8 g of 16; 0.00 % of the readings lost at the end of the range"
    )
