"""The page installs the firmware and its config.py on a board, with the code of `kickstand flash`."""

import re
import types

import pytest
from kickstand_tools.deploy import firmware_files
from kickstand_tools.deploy.bytecode import PICO
from support import command, fake_board
from support.fake_board import FakeBoard
from support.web.raw_prompt import RawPrompt
from support.web.rider import LAPTOP, PHONE, Rider
from support.web.serial_line import SerialLine

FIRMWARE = firmware_files.contents(PICO)


@pytest.fixture(scope="module")
def line(chromium, address):
    """Return one page for all tests."""
    line = SerialLine(chromium, address + "install.html")
    yield line
    assert line.rider.errors == [] and line.rider.strangers() == []
    line.rider.context.close()


@pytest.fixture
def board(tmp_path):
    """Return a board on which only main.py and the modules of lean/ are missing, because copying takes time."""
    for path, data in FIRMWARE.items():
        if not path.startswith("/kickstand/lean/") and path.count("/") > 1:
            (tmp_path / path[1:]).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path[1:]).write_bytes(data)
    return FakeBoard(tmp_path)


def choose(line, name, value):
    line.rider.page.evaluate("document.querySelectorAll('#fields details').forEach((one) => (one.open = true))")
    field = line.rider.page.locator(f"[name={name}]")
    if field.evaluate("field => field.tagName") == "SELECT":
        field.select_option(value)
    else:
        field.fill(value)
        field.blur()


def test_a_new_board_gets_the_firmware_and_its_settings(line, board):
    """An invalid setting is reported beside its field, by the firmware's own rules. Nothing is copied until the setting
    is corrected."""
    line.plug_in(RawPrompt(board))
    assert line.look().startswith("Imagined Pico with RP2040, MicroPython 1.26.1 is there.")
    page = line.rider.page
    assert page.get_attribute("[name=BUTTON_PIN]", "placeholder") == "15"
    choose(line, "SIDE", '"right"')
    choose(line, "BUTTON_PIN", "99")
    assert "but it must be a number from 0 to 48" in line.rider.text("#fault-BUTTON_PIN")
    assert line.rider.axe() == []
    page.set_viewport_size({"width": 390, "height": 844})
    assert line.rider.fits()
    page.set_viewport_size({"width": 1280, "height": 720})
    assert page.is_disabled("#install")
    choose(line, "BUTTON_PIN", "5")
    assert "a pin is used twice" in line.rider.text("#config")
    choose(line, "BUTTON_PIN", "fifteen")
    assert "fifteen is not a value" in line.rider.text("#fault-BUTTON_PIN")
    choose(line, "BUTTON_PIN", "14")
    said = line.install()
    assert said.startswith("Done: Imagined Pico with RP2040, MicroPython 1.26.1.")
    on_it = fake_board.files(board.root)
    config = on_it.pop("/config.py").decode()
    assert [one.split("#")[0].strip() for one in config.splitlines() if one[:1].isupper()] == [
        'SIDE = "right"',
        "BUTTON_PIN = 14",
    ]
    assert on_it == {path: data for path, data in FIRMWARE.items() if path != "/config.py"}


def test_riders_settings_are_shown_and_kept(line, board):
    board.path("config.py").write_text("SIDE = 'right'  # mine\nDLPF = 0x4\n")
    line.plug_in(RawPrompt(board))
    line.look()
    page = line.rider.page
    assert page.locator("[name=SIDE] option:checked").inner_text() == "right"
    assert page.locator("[name=DLPF] option:checked").inner_text() == "4: 21 Hz"
    choose(line, "RECORD", "True")
    line.install()
    assert board.path("config.py").read_text() == "SIDE = 'right'  # mine\nDLPF = 0x4\nRECORD = True\n"


def test_each_board_has_its_own_default_pins(line, board):
    """Until the page knows the board, it shows a Pico's pins."""
    other(board, _machine="Generic ESP32 module with ESP32")
    board.modules["sys"].platform = "esp32"
    line.plug_in(RawPrompt(board))
    line.look()
    assert line.rider.page.get_attribute("[name=BUTTON_PIN]", "placeholder") == "4"
    choose(line, "BUTTON_PIN", "7")
    assert "no pin of the chip" in line.rider.text("#fault-BUTTON_PIN")


def test_config_with_more_than_settings_stays_with_the_rider(line, board):
    own = b"import sys\nRECORD = sys.platform == 'rp2'\n"
    board.path("config.py").write_bytes(own)
    line.plug_in(RawPrompt(board))
    line.look()
    assert "own config.py, line 1 is not a setting" in line.rider.text("#by-hand")
    assert line.rider.page.is_hidden("#settings")
    assert "Its own config.py stays" in line.install()
    assert board.path("config.py").read_bytes() == own


def test_pulled_cable_leaves_a_board_that_starts_nothing(line, board):
    """The user can flash the board again."""
    line.plug_in(RawPrompt(board))
    line.look()
    line.cut_after = 12_000
    assert line.install() == "Not installed: connection lost: plug the board in again, then repeat."
    assert not board.path("main.py").exists()
    line.plug_in(RawPrompt(board))
    line.look()
    assert "copied and verified" in line.install()
    assert board.path("main.py").exists()


def test_a_check_of_a_board_without_the_firmware_is_refused(line, board):
    """test_page_board.py tests a check of a complete board, with an emulated Pico."""
    line.plug_in(RawPrompt(board))
    assert line.check().startswith("the firmware on the board at this port is of another version or not whole")
    assert line.rider.page.is_visible("#check") and line.rider.axe() == []


def test_status_equals_the_output_of_the_command(line, board, monkeypatch):
    """The text can be copied into an issue."""
    line.plug_in(RawPrompt(board))
    assert line.status().startswith("Kickstand is not on the board at this port: install it with the page Install")
    report = "Kickstand 9.9.9\nSensor   MPU6050 at 0x68\n\nDisplay  none found"
    board.path("kickstand/__init__.py").write_text(f"def status():\n    print({report!r})\n")
    shown = line.status()
    fake_board.plug_in(monkeypatch, board)
    assert shown == command.works("status").out.rstrip() == report
    line.rider.context.grant_permissions(["clipboard-read", "clipboard-write"])
    line.rider.page.click("#status-copy")
    line.rider.page.wait_for_selector("#status-said:has-text('Copied')")
    assert line.rider.page.evaluate("navigator.clipboard.readText()") == report
    assert line.rider.axe() == []


def other(board, **differs):
    implementation = vars(board.modules["sys"].implementation) | differs
    board.modules["sys"].implementation = types.SimpleNamespace(**implementation)


@pytest.mark.parametrize(
    ("differs", "platform", "words"),
    [
        ({"version": (1, 22, 2)}, "rp2", "1.22.2: put MicroPython 1.23 or newer"),
        ({"name": "circuitpython"}, "rp2", "this port runs circuitpython: put MicroPython on the board first"),
        ({}, "stm32", "runs on a Raspberry Pi Pico"),
    ],
)
def test_unsuitable_board_is_not_changed(line, board, differs, platform, words):
    other(board, **differs)
    board.modules["sys"].platform = platform
    line.plug_in(RawPrompt(board))
    assert words in line.look()
    assert line.rider.page.is_hidden("#config")
    assert board.written == [] and board.resets == 1


def test_file_that_is_no_esp32_image_is_not_written(line, board, tmp_path):
    """The page also refuses an image for another chip. No chip answers in this test."""
    page = line.rider.page
    page.click("a[href='#micropython']")
    page.click("text=ESP32: a file that ends in .bin")
    for name, content, words in (
        ("notes.bin", b"hello", "no image for an ESP32"),
        ("pico.uf2", b"UF2\n" * 200, "no image for an ESP32"),
        ("esp32.bin", b"\xe9" + bytes(2000), "no ESP32 answers: hold its button BOOT"),
    ):
        (tmp_path / name).write_bytes(content)
        line.plug_in(RawPrompt(board, deaf=True))
        page.set_input_files("#image-file", tmp_path / name)
        page.click("#image")
        page.wait_for_function(
            "words => document.querySelector('#image-said').textContent.includes(words)", arg=words, timeout=120_000
        )
    page.wait_for_selector("#image:enabled")


def test_after_its_first_use_the_page_works_without_a_network(line, board):
    line.plug_in(RawPrompt(board))
    line.look()
    page = line.rider.page
    line.rider.context.set_offline(True)
    page.reload()
    line.plug_in(RawPrompt(board))
    assert "is there" in line.look()
    assert page.evaluate("document.querySelector('.wired img').naturalWidth") > 0
    line.rider.context.set_offline(False)


def test_the_form_has_every_setting(line):
    names = line.rider.page.evaluate(
        "async () => (await import('./install/fields.mjs')).GROUPS.flatMap(([, , of]) => of.map(([name]) => name))"
    )
    text = firmware_files.firmware_files()["/config.py"].read_text()
    assert sorted(names) == sorted(re.findall(r"(?m)^# ([A-Z_0-9]+) = ", text))


def test_setting_of_0_is_not_shown_as_the_default(line):
    shown = """async () => {
      const place = document.createElement("div");
      const fields = new (await import("./install/fields.mjs")).Fields(place, () => {});
      fields.fill({ LCD_I2C: "0" }, { LCD_I2C: "1" });
      return [place.querySelector("[name=LCD_I2C]").selectedOptions[0].text, fields.values().LCD_I2C];
    }"""
    assert line.rider.page.evaluate(shown) == ["0", "0"]


def test_browser_without_serial_ports_is_told_so(chromium, address):
    """The message is at the top of the page. The page offers no action that needs a serial port."""
    rider = Rider(chromium, address, script="delete Navigator.prototype.serial")
    for name in ("install.html", "live.html"):
        rider.page.goto(address + name)
        first = rider.page.locator("main section:visible").first
        assert first.get_attribute("id") == "unable"
        assert "in Chrome or Edge on a computer" in first.inner_text() and "Firefox, Safari" in first.inner_text()
        if name == "install.html":  # the page shows each step with the command for the terminal
            assert rider.page.locator("main h2:visible").count() == 5
            assert rider.text("#here") == address + name
            rider.page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
            said = rider.text("main")
            assert all(
                f"python3 -m {one}" in said for one in ("esptool write-flash", "mpremote cp -r", "mpremote exec")
            )
            assert "README" not in said and "project" not in said, "nothing leads there from here"
            assert "Choose the board" not in said, "there is no such button here"
            rider.page.set_viewport_size({"width": 390, "height": 844})
            wide = "all => all.filter((one) => one.checkVisibility() && one.scrollWidth > one.clientWidth).length"
            assert rider.page.eval_on_selector_all("main pre, main a:has(img)", wide) == 0, "cut at the right edge"
            assert rider.fits()
        for button in rider.page.locator("main button:not(#simulated, #simulated-stop)").all():
            assert button.is_hidden()
    assert rider.axe() == []
    rider.context.close()


def test_the_board_is_chosen_first_and_the_steps_around_it_open(chromium, address):
    """The steps fit on the first screen of a phone and of a laptop. The first step is open. A link to another step
    opens that step."""
    rider = Rider(chromium, address + "install.html", **PHONE)
    rider.page.evaluate("document.documentElement.dataset.serial = 'yes'")
    page = rider.page
    steps = "all => all.map((one) => [one.id, one.open])"
    for kind, opened in ((PHONE, []), (LAPTOP, ["parts"])):
        page.set_viewport_size(kind["viewport"])
        page.reload()
        look = page.locator("#look").bounding_box()
        assert look["y"] + look["height"] < kind["viewport"]["height"] / 3
        assert page.evaluate("document.documentElement.scrollHeight") < 2 * kind["viewport"]["height"]
        assert [id for id, is_open in page.eval_on_selector_all("details.step", steps) if is_open] == opened
    page.click("a[href='#micropython']")
    assert page.is_visible("#micropython .steps") and rider.fits()
    page.goto(address + "install.html#calibrate")
    page.reload()
    assert page.is_visible("#calibrate picture") and rider.axe() == []
    rider.context.close()


def test_browser_with_serial_ports_gets_no_other_advice(line):
    assert line.rider.page.is_hidden("#unable")
    assert line.rider.page.is_visible("#look")


def test_the_wiring_is_that_of_the_boards_own_pins(line):
    """The tables and the drawing show the pins that the firmware uses."""
    page = line.rider.page
    for board, pins in (
        ("pico", ["GP4, pin 6", "GP5, pin 7", "GP6, pin 9", "GP7, pin 10", "GP15, pin 20"]),
        ("esp32", [f"GPIO {number}" for number in (21, 22, 18, 19, 4)]),
    ):
        wired = page.locator(f".wired:has(img[src='./wiring_{board}.svg'])")
        cells = wired.locator("td:last-child").all_text_contents()
        assert [cell for cell in cells if "GND" not in cell and "3V3" not in cell] == pins
        wired.evaluate("wired => (wired.closest('details').open = true)")
        picture = wired.locator("img")
        picture.scroll_into_view_if_needed()
        page.wait_for_function("img => img.complete && img.naturalWidth > 0", arg=picture.element_handle())


def test_each_board_has_its_own_page_for_micropython(line):
    """The link opens a new tab."""
    links = line.rider.page.locator("a[href^='https:']")
    assert links.evaluate_all("links => links.map((one) => [one.target, one.rel])") == 10 * [["_blank", "noopener"]]
    names = links.evaluate_all("links => links.map((one) => one.href)")
    assert names[:2] == [f"https://micropython.org/download/{board}/" for board in ("RPI_PICO", "RPI_PICO_W")]
    assert len(set(names)) == 10
