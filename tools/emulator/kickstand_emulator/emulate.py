"""Runs `kickstand emulate`, an emulated board to which `kickstand flash` can deploy.

The board has a sensor, a display and a button, and is on a simulated bike.
"""

import contextlib
import socket
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias, cast

from kickstand_sim.demo.device import (
    KICKSTAND_PRESS_S,
    LONG_PRESS_S,
    PART_SEED,
    PART_SHARE,
    SCRIPT,
    UPRIGHT_PRESS_S,
    seen,
)
from kickstand_sim.demo.hand_bike import HandBike
from kickstand_sim.demo.keyboard import BIKE_KEYS, keyboard
from kickstand_sim.demo.score import State
from kickstand_sim.demo.screen import lcd_lines, screen
from kickstand_sim.simulated_board.oled import Oled
from kickstand_sim.simulation.scripted.script import Ride
from kickstand_sim.simulation.scripted.sensor_errors import Sensor
from kickstand_tools.common.messages import InputError, cause
from rich.live import Live

from .device import EmulatedDevice

if TYPE_CHECKING:
    from .esp32 import Esp32
    from .pico import Pico


class ConsoleServer:
    """Serves one client at a time, as a serial port does. Call poll() often.

    Args:
        send: Function that is called with the client's data.
        port: Number of the TCP port. 0 chooses a free port.

    The attribute `port` holds the actual number. Raises InputError if the port cannot be opened.
    """

    def __init__(self, send: Callable[[bytes], None], port: int) -> None:
        self._send = send
        self._client: socket.socket | None = None
        try:
            self._server = socket.create_server(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} cannot be opened: {cause(error)}; choose another") from error
        self._server.setblocking(False)
        self.port: int = self._server.getsockname()[1]

    def close(self) -> None:
        self._disconnect()
        self._server.close()

    def poll(self) -> None:
        """Accept a client, or pass what it has sent to the board."""
        if self._client is None:
            with contextlib.suppress(BlockingIOError):
                self._client = self._server.accept()[0]
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._client.setblocking(False)
            return
        try:
            data = self._client.recv(4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._send(data)
        else:
            self._disconnect()

    def say(self, data: bytes) -> None:
        """Send the board's output to the client. Without a client the output is lost."""
        if self._client:
            try:
                self._client.setblocking(True)
                self._client.sendall(data)
                self._client.setblocking(False)
            except OSError:
                self._disconnect()

    def _disconnect(self) -> None:
        if self._client:
            self._client.close()
            self._client = None


Kind: TypeAlias = "type[Pico] | type[Esp32]"

_STEP_S = 0.02
_BUTTON = {"b": 0.15, "B": LONG_PRESS_S, " ": LONG_PRESS_S}  # key: length of the press in s
_HELP = "b button   B long press   a/d lean   k kickstand   u upright   q quit"
_NO_FIRMWARE = "No firmware on it yet, so the display is blank. In another terminal:\n  kickstand flash --port {}\n"


def device_class(chip: str) -> Kind:
    """Return the class of the emulated board with this chip, and import only the packages of its emulator."""
    if chip == "esp32":
        from .esp32 import Esp32

        return Esp32
    from .pico import Pico

    return Pico


class ScriptedBike:
    """The demo's ride. The ride begins when the display switches on, because the firmware has then started."""

    def __init__(self) -> None:
        self._ride = Ride(SCRIPT)
        self.begun_s: float | None = None

    def motion(self, t_s: float) -> tuple[float, ...]:
        return self._ride.motion(0.0 if self.begun_s is None else t_s - self.begun_s)

    def follow(self, device: EmulatedDevice) -> None:
        if self.begun_s is None and device.board.lcd.on:
            self.begun_s = device.time_s
            for press_s in (KICKSTAND_PRESS_S, UPRIGHT_PRESS_S):
                device.press(self.begun_s + press_s)


def emulate(port: int, say: Callable[[str], None], chip: str = "rp2040", display: str = "lcd") -> None:
    """Serve an emulated board's console on socket://127.0.0.1:port until the user quits. Raises InputError.

    In a terminal the user steers the bike with keys. Without a terminal, say() receives each new text of the display,
    and the bike follows the demo's ride as soon as the firmware runs.

    say: Function that prints a text.
    chip: "rp2040" or "esp32".
    display: "lcd", "ssd1306" or "sh1106".
    """
    watched = sys.stdin.isatty() and sys.stdout.isatty()
    bike = HandBike() if watched else ScriptedBike()
    device = device_class(chip)(Sensor(seed=PART_SEED, share=PART_SHARE).world(bike.motion), display=display)
    server = ConsoleServer(device.send, port)
    device.heard = server.say
    address = f"socket://127.0.0.1:{server.port}"
    say(f"an emulated {device.NAME} without firmware on {address}: kickstand flash --port {address}")
    try:
        with contextlib.suppress(KeyboardInterrupt), device:
            if isinstance(bike, HandBike):
                _watch(device, server, bike, address)
            else:
                _print(device, server, bike, say)
    finally:
        server.close()


def _run(device: EmulatedDevice, server: ConsoleServer) -> None:
    """Advance the time by one step, but not faster than real time. The time-outs of mpremote use the host's clock."""
    begun, previous_s = time.monotonic(), device.time_s
    device.run(_STEP_S, server.poll)
    time.sleep(max(0.0, device.time_s - previous_s - (time.monotonic() - begun)))


def _watch(device: EmulatedDevice, server: ConsoleServer, bike: HandBike, address: str) -> None:
    """Run the device in step with real time, with its screen in the terminal, until the user quits."""
    with keyboard() as pressed, Live(screen=True, auto_refresh=False) as live:
        while True:
            for key in pressed(0.0):
                if key == "q":
                    return
                if key in _BUTTON:
                    device.press(for_s=_BUTTON[key])
                elif key in BIKE_KEYS:
                    bike.command(BIKE_KEYS[key])
            _run(device, server)
            state = cast(State, seen(device.board, bike))
            if isinstance(device.board.lcd, Oled):
                state["pixels"] = device.board.lcd.pixels().hex()
            title = f"Kickstand on an emulated {device.NAME}, {address}"
            live.update(screen(state, title, below(device.board.lcd.on, address), False), refresh=True)


def below(on: bool, address: str) -> str:
    """Return the text below the picture. on: True if the firmware has switched the display on."""
    return _HELP if on else _NO_FIRMWARE.format(address) + _HELP


def _print(device: EmulatedDevice, server: ConsoleServer, bike: ScriptedBike, say: Callable[[str], None]) -> None:
    lines: list[str] = device.lcd()
    while True:
        _run(device, server)
        bike.follow(device)
        if device.lcd() != lines:
            lines = device.lcd()
            say(f"{device.time_s:8.2f} s")
            say("\n".join(lcd_lines(lines)))
