"""Tests which config.py of a rider is flashed, and how the computer and the board report a mistake in it."""

import pytest
from kickstand_tools.common import errors, firmware_path
from kickstand_tools.simulated_board.fakes import chips
from support import command, fake_board, mpy


@pytest.fixture
def board(tmp_path, monkeypatch):
    """Return the only connected board. It contains a config.py."""
    (tmp_path / "flash").mkdir()
    board = fake_board.FakeBoard(tmp_path / "flash")
    board.path("config.py").write_text("# on the board\n")
    return fake_board.plug_in(monkeypatch, board)


@pytest.fixture
def config(tmp_path, monkeypatch):
    """Return the config.py of a checkout in the current folder. The command itself is installed elsewhere."""
    firmware = tmp_path / "checkout" / "firmware"
    (firmware / "kickstand").mkdir(parents=True)
    (firmware / "config.py").write_text('SIDE = "right"\n')
    monkeypatch.chdir(tmp_path / "checkout")
    return firmware / "config.py"


def test_the_checkout_s_config_is_flashed_and_named(board, config):
    result = command.works("flash", "--config")
    assert board.path("config.py").read_text() == 'SIDE = "right"\n'
    assert f"config.py is {config}\n" in result.out


def test_installed_package_uses_config_of_the_current_folder(board, tmp_path, monkeypatch):
    """Riders should not edit the config.py in site-packages, because the next update replaces it."""
    package = tmp_path / "site-packages" / "kickstand_tools"
    (package / "firmware").mkdir(parents=True)
    (package / "firmware" / "config.py").write_text("# as shipped\n")
    (package / "firmware" / "main.py").write_text("")
    (tmp_path / "mine").mkdir()
    monkeypatch.chdir(tmp_path / "mine")
    monkeypatch.setattr(firmware_path, "TOOLS", package.parent)
    said = command.works("flash", "--config").out
    assert f"config.py is {package / 'firmware' / 'config.py'}\n" in said
    assert "to change settings, copy that file to a folder of your own" in said
    (tmp_path / "mine" / "config.py").write_text('SIDE = "right"\n')
    result = command.works("flash", "--config")
    assert f"config.py is {tmp_path / 'mine' / 'config.py'}\n" in result.out
    assert "to change settings" not in result.out
    assert board.path("config.py").read_text() == 'SIDE = "right"\n'
    assert '-m pip install "kickstand-lean[rides]"' in errors.extra("rides")


@pytest.mark.parametrize("arguments", [["flash"], ["flash", "--config"]])
def test_setting_behind_a_mark_is_reported(arguments, board, config):
    """A setting behind a '#' has no effect. The message gives the line of the setting, also if config.py is not copied.
    The file as shipped has only examples behind a '#', which are not reported."""
    shipped = (firmware_path.directory() / "config.py").read_text()
    config.write_text(shipped.replace('# SIDE = "left" ', '# SIDE = "right"'))
    said = f"note: {config}, line 4: SIDE = \"right\" is not used, because a '#' is in front of it"
    result = command.works(*arguments)
    assert said in result.out
    assert result.out.count("note: ") == 1
    config.write_text(shipped)
    assert "note: " not in command.works(*arguments).out


SLIPS = {
    "syntax": ('# one\nSIDE = "right\n', 2, "SyntaxError: unterminated string"),
    "no string": ("# one\n\nSIDE = right\n", 3, "NameError: name 'right' is not defined"),
    "value": ('# one\nSIDE = "rigth"\n', 2, "SIDE = 'rigth', but it must be one of 'left', 'right'"),
    "name": ('SIDDE = "right"\n', 1, "SIDDE is not a setting"),
    "low-pass": ("# one\nSAMPLE_HZ = 50\nDLPF = 3\n", 3, "DLPF = 3 lets vibration alias at SAMPLE_HZ = 50: set DLPF"),
    "capitals": ('Side = "right"\n', 1, "Side is not a setting"),
    "no line of its own": ("BUTTON_PIN = 4\n", None, "a pin is used twice"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_mistake_in_config_is_refused_before_copying(slip, board, config):
    text, line, reason = SLIPS[slip]
    config.write_text(text)
    words = f"{config}, line {line}: {reason}" if line else f"{config}: {reason}"
    command.refused(board.root, "flash", "--config", words=words)
    assert board.resets == 1  # the board restarts, so its program runs again


def test_a_new_board_gets_no_faulty_config_either(board, config):
    board.path("config.py").unlink()
    config.write_text("SIDE = right\n")
    command.refused(board.root, "flash", words="line 1: NameError")


def test_config_that_is_not_copied_is_not_checked(board, config):
    config.write_text("SIDE = right\n")
    result = command.works("flash")
    assert board.path("config.py").read_text() == "# on the board\n"
    assert "config.py is" not in result.out


def pose(board, machine):
    """Let the fake board identify itself as another board. machine: a key of chips.MACHINES."""
    system = board.modules["sys"]
    system.implementation._machine = chips.MACHINES[machine]
    system.platform = "esp32" if "ESP32" in chips.MACHINES[machine] else "rp2"


@pytest.mark.parametrize(("machine", "status"), [("pico", 2), ("pico 2", 2), ("esp32", 0)])
def test_config_is_checked_for_the_board(machine, status, board, config):
    pose(board, machine)
    config.write_text("BUTTON_PIN = 4\n")  # on a Pico pin 4 is the sensor's SDA
    assert command.run("flash", "--config").status == status


@pytest.mark.parametrize("machine", ["s3", "c6", "xiao rp2040"])
def test_a_board_without_usual_pins_needs_them_named(machine, board, config):
    pose(board, machine)
    names = "BUTTON_PIN, SENSOR_SDA, SENSOR_SCL, LCD_SDA, LCD_SCL"
    words = f"{config}: no usual pins are known for this board ({chips.MACHINES[machine]}): set {names}: correct it"
    command.refused(board.root, "flash", "--config", words=words)
    pins = zip(names.split(", "), (0, 2, 4, 5, 14), strict=True)
    config.write_text("".join(f"{name} = {number}\n" for name, number in pins))
    command.works("flash", "--config")


def test_a_pin_of_the_chip_s_own_usb_is_refused(board, config):
    pose(board, "s3")
    config.write_text("BUTTON_PIN = 4\nSENSOR_SDA = 8\nSENSOR_SCL = 9\nLCD_SDA = 18\nLCD_SCL = 19\n")
    words = f"{config}, line 5: LCD_SCL = 19, but it must be a number from 0 to 48, no pin of the chip's own USB"
    command.refused(board.root, "flash", "--config", words=words)


_LOAD = """
import sys
from kickstand_tools.simulated_board.simulator import Board
Board(lambda t_s: (0, 0, 1, 0, 0, 0)).install()
sys.path.insert(0, DIRECTORY)
from kickstand import settings
from kickstand.errors import SettingsError
try:
    settings.load()
except SettingsError as error:
    from kickstand.console import sentence
    print(sentence(error))
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("# one\n\nSIDE = = 3\n", "config.py cannot be read (line 3: invalid syntax"),
        ("# one\nSIDE = right\n", "config.py cannot be read (line 2: name 'right' "),
    ],
)
def test_board_also_names_the_line(text, said, tmp_path):
    (tmp_path / "config.py").write_text(text)
    assert mpy.run_mpy(_LOAD.replace("DIRECTORY", repr(str(tmp_path)))).startswith(said)
