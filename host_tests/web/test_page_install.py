"""The page Install in Chromium: it installs the firmware and its settings with the code of `kickstand flash`.

The board is a simulated one at a serial port in the test's process. Python starts once, because most tests use one
page.
"""

import re
import types

import pytest
from kickstand_tools.deploy import firmware_files
from kickstand_tools.deploy.firmware_files import PICO
from support import command, fake_board
from support.fake_board import FakeBoard
from support.web.raw_prompt import RawPrompt
from support.web.rider import LAPTOP, PHONE, Rider
from support.web.serial_line import SerialLine

pytestmark = pytest.mark.long
FIRMWARE = firmware_files.contents(PICO)


@pytest.fixture(scope="module")
def line(chromium, address):
    line = SerialLine(chromium, address + "install.html")
    yield line
    assert line.rider.errors == [] and line.rider.strangers() == []
    line.rider.context.close()


@pytest.fixture
def page(line):
    return line.rider.page


@pytest.fixture
def board(tmp_path):
    """Return a board on which only main.py and the modules of lean/ are missing, because copying takes time."""
    for path, data in FIRMWARE.items():
        if not path.startswith("/kickstand/lean/") and path.count("/") > 1:
            (tmp_path / path[1:]).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path[1:]).write_bytes(data)
    return FakeBoard(tmp_path)


def look(line, board):
    line.plug_in(RawPrompt(board))
    return line.look()


def choose(page, name, value):
    page.evaluate("document.querySelectorAll('#fields details').forEach((one) => (one.open = true))")
    field = page.locator(f"[name={name}]")
    if field.evaluate("field => field.tagName") == "SELECT":
        field.select_option(value)
    else:
        field.fill(value)
        field.blur()


def test_a_new_board_gets_the_firmware_and_its_settings(line, page, board):
    """An invalid setting is reported beside its field, by the firmware's own rules. Nothing is copied until it is
    corrected."""
    assert look(line, board).startswith("Imagined Pico with RP2040, MicroPython 1.26.1 is there.")
    assert page.get_attribute("[name=BUTTON_PIN]", "placeholder") == "15"
    choose(page, "SIDE", '"right"')
    for value, element, words in (
        ("99", "#fault-BUTTON_PIN", "but it must be a number from 0 to 48"),
        ("5", "#config", "a pin is used twice"),
        ("fifteen", "#fault-BUTTON_PIN", "fifteen is not a value"),
    ):
        choose(page, "BUTTON_PIN", value)
        assert words in line.rider.text(element) and page.is_disabled("#install")
    assert line.rider.axe() == []
    for kind in PHONE, LAPTOP:
        page.set_viewport_size(kind["viewport"])
        assert line.rider.fits()
    choose(page, "BUTTON_PIN", "14")
    assert line.install().startswith("Done: Imagined Pico with RP2040, MicroPython 1.26.1.")
    installed = fake_board.files(board.root)
    settings = [
        row.split("#")[0].strip() for row in installed.pop("/config.py").decode().splitlines() if row[:1].isupper()
    ]
    assert settings == ['SIDE = "right"', "BUTTON_PIN = 14"]
    assert installed == {path: data for path, data in FIRMWARE.items() if path != "/config.py"}


def test_riders_settings_are_shown_and_kept(line, page, board):
    board.path("config.py").write_text("SIDE = 'right'  # mine\nDLPF = 0x4\n")
    look(line, board)
    assert page.locator("[name=SIDE] option:checked").inner_text() == "right"
    assert page.locator("[name=DLPF] option:checked").inner_text() == "4: 21 Hz"
    choose(page, "RECORD", "True")
    line.install()
    assert board.path("config.py").read_text() == "SIDE = 'right'  # mine\nDLPF = 0x4\nRECORD = True\n"


def test_config_with_more_than_settings_stays_with_the_rider(line, page, board):
    user_config = b"import sys\nRECORD = sys.platform == 'rp2'\n"
    board.path("config.py").write_bytes(user_config)
    look(line, board)
    assert "own config.py, line 1 is not a setting" in line.rider.text("#by-hand") and page.is_hidden("#settings")
    assert "Its own config.py stays" in line.install()
    assert board.path("config.py").read_bytes() == user_config


def test_a_board_of_a_shop_is_offered_by_its_name(line, page, board):
    """Only boards with the same chip are offered. The firmware accepts their pins."""
    look(line, board)
    names = page.locator("#shop-board option").all_text_contents()
    assert names[:3] == ["another board", "Seeed XIAO RP2040, RP2350", "Waveshare RP2040-Zero"]
    assert not any("ESP32" in name for name in names)
    page.select_option("#shop-board", "Seeed XIAO RP2040, RP2350")
    assert page.input_value("[name=BUTTON_PIN]") == "2" and page.input_value("[name=SENSOR_I2C]") == "1"
    text = line.rider.text("#config")
    assert "used twice" not in text and page.is_enabled("#install")
    assert "SENSOR_SDA = 6" in page.text_content("#text")
    page.select_option("#shop-board", "another board")
    assert page.input_value("[name=BUTTON_PIN]") == "" and "\nSENSOR_SDA" not in page.text_content("#text")


def test_status_keeps_what_the_firmware_noticed_before_it_is_stopped(line, board):
    """A soft reset removes the firmware's modules, before the status is asked."""
    app, firmware = (types.ModuleType(name) for name in ("app", "kickstand"))
    vars(app)["worst"] = (1200, 3, ((1, 2, 3), 0.5))
    vars(firmware).update(status=lambda: print("noticed (None, None)"))
    board.modules["kickstand"] = firmware
    vars(board.modules["sys"])["modules"] = {"kickstand.app": app}
    line.plug_in(RawPrompt(board))
    assert line.status().startswith("Since start  longest turn 1.2 ms; places left in the FIFO, at the fewest: 3\n")


@pytest.mark.parametrize(
    ("name", "version", "platform", "words"),
    [
        ("micropython", (1, 22, 2), "rp2", "1.22.2: put MicroPython 1.23 or newer"),
        ("circuitpython", (9, 0, 0), "rp2", "this port runs circuitpython: put MicroPython on the board first"),
        ("micropython", (1, 26, 1), "stm32", "runs on a Raspberry Pi Pico"),
    ],
)
def test_unsuitable_board_is_not_changed(line, page, tmp_path, name, version, platform, words):
    board = FakeBoard(tmp_path, name, version=version, platform=platform)
    assert words in look(line, board)
    assert page.is_hidden("#config") and board.written == [] and board.resets == 1


def test_pulled_cable_leaves_a_board_that_starts_nothing(line, board):
    """The user can flash the board again."""
    look(line, board)
    line.cut_after = 12_000
    assert line.install() == "Not installed: connection lost: plug the board in again, then repeat."
    assert not board.path("main.py").exists()
    look(line, board)
    assert "copied and verified" in line.install() and board.path("main.py").exists()


def test_status_equals_the_output_of_the_command(line, page, board, monkeypatch):
    """The text can be copied into an issue. A board without the firmware has neither a status nor a check."""
    line.plug_in(RawPrompt(board))
    assert line.check().startswith("the firmware on the board at this port is of another version or not whole")
    assert line.status().startswith("Kickstand is not on the board at this port: install it with the page Install")
    report = "Kickstand 9.9.9\nSensor   MPU6050 at 0x68\n\nDisplay  none found"
    board.path("kickstand/__init__.py").write_text(f"def status():\n    print({report!r})\n")
    status = line.status()
    fake_board.plug_in(monkeypatch, board)
    assert status == command.works("status").out.rstrip() == report
    line.rider.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#status-copy")
    page.wait_for_selector("#status-said:has-text('Copied')")
    assert page.evaluate("navigator.clipboard.readText()") == report


def test_after_its_first_use_the_page_works_without_a_network(line, page, board):
    """The pictures are kept when they are first seen with the service worker ready."""
    page.evaluate("async () => { await navigator.serviceWorker.ready }")
    for offline in (False, True):
        line.rider.context.set_offline(offline)
        page.reload()
        assert "is there" in look(line, board)
        page.wait_for_function("document.querySelector('.wired img').naturalWidth > 0")
    line.rider.context.set_offline(False)


def test_the_form_has_every_setting(page):
    """A setting of 0 is not shown as the default."""
    names = page.evaluate(
        "async () => (await import('./install/fields.mjs')).GROUPS.flatMap(([, , of]) => of.map(([name]) => name))"
    )
    text = firmware_files.firmware_files()["/config.py"].read_text()
    assert sorted(names) == sorted(re.findall(r"(?m)^# ([A-Z_0-9]+) = ", text))
    zero = """async () => {
      const place = document.createElement("div");
      const fields = new (await import("./install/fields.mjs")).Fields(place, () => {});
      fields.fill({ LCD_I2C: "0" }, { LCD_I2C: "1" });
      return [place.querySelector("[name=LCD_I2C]").selectedOptions[0].text, fields.values().LCD_I2C];
    }"""
    assert page.evaluate(zero) == ["0", "0"]


@pytest.mark.parametrize("name", ["install.html", "live.html"])
def test_browser_without_serial_ports_is_told_so(chromium, address, name):
    """The message is at the top of the page. The page offers no action that needs a serial port. The page Install
    shows each step with the command for the terminal."""
    rider = Rider(chromium, address + name, script="delete Navigator.prototype.serial", **PHONE)
    page = rider.page
    first = page.locator("main section:visible").first
    assert first.get_attribute("id") == "unable"
    assert "in Chrome or Edge on a computer" in first.inner_text() and "Firefox, Safari" in first.inner_text()
    for button in page.locator("main button:not(#simulated, #simulated-stop, #ride)").all():
        assert button.is_hidden()
    if name == "install.html":
        assert page.locator("main h2:visible").count() == 5 and rider.text("#here") == address + name
        page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
        text = rider.text("main")
        for words in ("esptool write-flash", "mpremote cp -r", "mpremote exec"):
            assert f"python3 -m {words}" in text
        assert "Choose the board" not in text, "there is no such button here"
        wide = "all => all.filter((one) => one.checkVisibility() && one.scrollWidth > one.clientWidth).length"
        assert page.eval_on_selector_all("main pre, main a:has(img)", wide) == 0, "cut at the right edge"
        assert rider.axe() == []
    assert rider.fits()
    rider.context.close()
