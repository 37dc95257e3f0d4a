"""The lines of kickstand.status(), with known readings, memory and worst values."""

import io
import os
import sys
from contextlib import redirect_stdout
from types import SimpleNamespace

import pytest
from kickstand.errors import SettingsError
from kickstand_tools.simulated_board.simulator import Board


def world(t_s):
    """Readings that change, so that no axis looks dead. The mean forces are 0.5 g, 0.25 g and 0.75 g."""
    a, b, c = (t_s * k % 1 - 0.5 for k in (977, 577, 433))
    return (0.5 + 0.004 * a, 0.25 + 0.004 * b, 0.75 + 0.004 * c, 0.4 * b, 0.4 * c, 0.4 * a, 31.0)


@pytest.fixture
def report(tmp_path, monkeypatch):
    """Return report(...), which returns the lines of the report. fit(board, module) changes the board or the module."""
    monkeypatch.chdir(tmp_path)

    def run(config=None, fit=None, world=world, **fitted):
        out = io.StringIO()
        with Board(world, **fitted) as board, redirect_stdout(out):
            from kickstand import settings, status_report
            from kickstand.lean import consistency

            monkeypatch.setattr(status_report.gc, "mem_free", lambda: 50 * 1024 + 1023, raising=False)
            found = settings.Settings(SimpleNamespace(**(config or {})))
            monkeypatch.setattr(status_report, "load", lambda: found)
            monkeypatch.delitem(sys.modules, "kickstand.app", raising=False)
            monkeypatch.setattr(consistency, "last_odd", None)  # an earlier test may have run the app
            if fit:
                fit(board, status_report)
            assert board.run(status_report.report, 60.0) == "returned"
        return out.getvalue().splitlines()

    return run


def line(lines, label):
    """Return the rest of the line that begins with this label."""
    (found,) = [text[13:] for text in lines if text[:13].strip() == label and text[:1] != " "]
    return found


def test_the_report_of_a_new_board(report):
    lines = report()
    assert lines[0].startswith("Kickstand 0.") and ", MicroPython " in lines[0]
    assert line(lines, "Settings") == "motorcycle, kickstand side left, 200 samples per second"
    sensor = line(lines, "Sensor")
    assert sensor.startswith("MPU6050 (0x68), +-16 g, +-500 deg/s, 3") and sensor.endswith(" C")
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
    assert line(lines, "Memory").startswith("50 KB free; flash ")
    assert not [text for text in lines if text.startswith(("Sensor odd", "Since start", "Vibration"))]


def test_flash_is_counted_in_kb_and_a_written_block_is_timed(report, monkeypatch):
    """A block of flash has 4096 bytes."""
    written = []

    def fit(board, module):
        real_open = open

        def remove(path):
            written.append(os.path.getsize(path))
            os.remove(path)

        def statvfs(path):
            assert path == "/"
            return (4096, 4096, 212, 100, 100, 0, 0, 0, 0, 255)

        def slow_open(path, mode):
            assert (path, mode) == ("trial.tmp", "wb")
            board.clock.advance(37_000)
            return real_open(path, mode)

        monkeypatch.setattr(module, "os", SimpleNamespace(statvfs=statvfs, remove=remove))
        monkeypatch.setattr(module, "open", slow_open, raising=False)

    words, took = line(report(fit=fit), "Memory").rsplit(", ", 1)
    assert words == "50 KB free; flash 400 KB free"
    assert took.endswith(" ms to write a block") and 37 <= int(took.split()[0]) <= 39
    assert written == [4096] and not os.path.exists("trial.tmp")


@pytest.mark.parametrize(("display", "words"), [("lcd", "LCD at 0x27"), ("ssd1306", "OLED at 0x3c")])
def test_the_display_is_named(report, display, words):
    assert line(report(display=display), "Display") == words


def test_a_display_that_does_not_answer_is_reported_with_its_bus(report):
    lines = report(lcd_address=None)
    assert "Display bus  SDA 6, SCL 7: nothing answers" in lines
    assert line(lines, "Display") == "none answers: check wiring and LCD_ADDRESSES"


def test_a_shared_bus_is_listed_once(report):
    lines = report({"LCD_SDA": 4, "LCD_SCL": 5}, one_bus=True)
    assert "Sensor bus   SDA 4, SCL 5: 0x27 display, 0x68 MPU6050" in lines
    assert not [text for text in lines if text.startswith("Display bus")]


def test_a_pressed_button_is_reported(report):
    def fit(board, module):
        board.press(0.0, 60.0)

    assert line(report(fit=fit), "Button") == "GPIO 15, pressed"


def test_without_a_sensor_no_axes_and_no_calibration_are_reported(report):
    lines = report(sensor_address=None)
    assert line(lines, "Sensor").startswith("none answers")
    assert line(lines, "Calibration") == "not looked at: it belongs to a sensor"
    assert not [text for text in lines if text.startswith(("Axes", "Reading"))]


def test_a_dead_axis_is_reported(report):
    lines = report(world=lambda t_s: (*world(t_s)[:4], 0.0, *world(t_s)[5:]))
    assert line(lines, "Axes") != "all six measure" and ", " in line(lines, "Axes")


def test_wrong_settings_end_the_report(report, monkeypatch):
    def fit(board, module):
        def load():
            raise SettingsError("pin-twice", "", "BUTTON_PIN, SENSOR_SDA")

        monkeypatch.setattr(module, "load", load)

    assert report(fit=fit)[1:] == ["Settings     config.py: a pin is used twice among BUTTON_PIN, SENSOR_SDA"]


def test_the_worst_of_the_last_run_is_reported(report, monkeypatch):
    def fit(board, module):
        from kickstand.lean import consistency

        monkeypatch.setattr(consistency, "last_odd", "odd-left")
        app = SimpleNamespace(worst=(12_340, 47, ([2048, 4096, 6144], 0.0125)))
        monkeypatch.setitem(sys.modules, "kickstand.app", app)

    lines = report(fit=fit)
    assert "again and again: force to the left." in line(lines, "Sensor odd")
    assert line(lines, "Since start") == "longest turn 12.3 ms; places left in the FIFO, at the fewest: 47"
    assert line(lines, "Vibration") == (
        "largest force 1.0 2.0 3.0 g of 16; 1.25 % of the readings lost at the end of the range"
    )


@pytest.mark.parametrize("slow", [[], [1], [0, 3]])
def test_functions_without_machine_code_are_named(report, slow, monkeypatch):
    """CPython has no machine code. So the test replaces the functions in use by other functions."""
    from kickstand.calibration import transform
    from kickstand.imu import fifo_frames
    from kickstand.rides import block

    used = [(fifo_frames, "decode"), (fifo_frames, "add_up"), (transform, "products"), (block, "encode")]

    def fit(board, module):
        for number, (owner, name) in enumerate(used):
            plain = getattr(owner, name + "_python")
            monkeypatch.setattr(owner, name, plain if number in slow else lambda *a, plain=plain: plain(*a))

    words = line(report(fit=fit), "Machine code")
    names = ", ".join(used[number][1] + "_python" for number in slow)
    assert words == (f"not used for {names}: slower code runs instead" if slow else "used")


@pytest.mark.parametrize(("speed", "said"), [(15.0, "  15.0 m/s"), (0.0, "  0.0 m/s")])
def test_the_last_speed_of_a_gps_is_reported(report, speed, said):
    def fit(board, module):
        board.fit_gps(lambda t_s: speed)

    lines = report({"SPEED": "gps"}, fit=fit)
    assert lines[lines.index("Speed        GPS on UART 1, RX 9, 9600 baud:") + 1] == said


def test_a_wheel_that_does_not_turn_is_reported(report):
    def fit(board, module):
        board.fit_wheel(lambda t_s: 0.0)

    lines = report({"SPEED": "wheel", "PULSES_PER_METRE": 2}, fit=fit)
    at = lines.index("Speed        wheel on GPIO 14, 2.00 pulses a metre:")
    assert "no pulse" in lines[at + 1]
