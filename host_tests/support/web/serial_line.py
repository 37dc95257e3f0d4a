"""A serial port in the browser, connected to a board in the test's own process.

Emulated time passes only while the page listens.
"""

import base64
import json
from pathlib import Path

from support.web.raw_prompt import RawPrompt
from support.web.rider import Rider

# Replaces navigator.serial. boardSays() and boardHears() are Python functions.
FAKE = Path(__file__).with_name("fake_serial.js").read_text()


class SerialLine:
    """A port between a page and a board.

    rider: the Rider who uses the page.
    said: all output of the board.
    cut_after: number of bytes to the board after which the cable is pulled. None: never.
    """

    STEP_S = 0.04  # longest emulated time until the page may send again

    def __init__(self, browser, address, **kind):
        self.rider = rider = Rider(browser, address, script=FAKE, **kind)
        rider.page.expose_function("boardSays", self._says)
        rider.page.expose_function("boardHears", self._hears)

    def plug_in(self, device):
        """Connect a board. device: a RawPrompt, or an emulator.pico.Pico whose time this line advances."""
        self.rider.page.evaluate(f"boardAnswersAtOnce = {json.dumps(isinstance(device, RawPrompt))}")
        self._device = device
        self._said, self.said = bytearray(), bytearray()
        self.connected = True
        self.sent = 0
        self.cut_after: int | None = None
        device.heard = self._hear

    def _hear(self, data):
        self._said += data
        self.said += data
        self._device.stop()

    def _says(self):
        if not self.connected:
            return None
        self._device.run(self.STEP_S)
        text = base64.b64encode(bytes(self._said)).decode()
        self._said.clear()
        return text

    def _hears(self, text):
        data = base64.b64decode(text)
        self.sent += len(data)
        if self.cut_after is not None and self.sent > self.cut_after:
            self.connected = False
        if self.connected:
            self._device.send(data)
        return self.connected

    def look(self):
        """Let the page look at the board. Return the page's text about it."""
        self.rider.page.click("#look")
        return self._said_by("#look")

    def install(self):
        """Let the page install the firmware. Return the page's final message."""
        self.rider.page.click("#install")
        return self._said_by("#look")

    def status(self):
        """Let the page read the board's status. Return the shown status, or the error that the page shows."""
        self.rider.page.click("#status")
        reason = self._said_by("#status", "#status-said")
        return self.rider.text("#status-text") if self.rider.page.is_visible("#status-text") else reason

    def check(self):
        """Let the page check the board. Return the shown findings, or the error that the page shows."""
        self.rider.page.click("#check")
        reason = self._said_by("#check", "#status-said")
        return self.rider.text("#status-text") if self.rider.page.is_visible("#status-text") else reason

    def _said_by(self, button, where="#install-said"):
        self.rider.page.wait_for_selector(f"{button}:enabled", timeout=600_000)
        return self.rider.text(where)
