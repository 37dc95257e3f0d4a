"""`kickstand status`: the words for the facts that kickstand.status() prints on a board."""

import ast
from collections.abc import Iterator
from typing import Any

from mpremote.transport_serial import SerialTransport

from .connection import Port, connected, describe, literal, printed, restart

# For each code of the firmware's lean/consistency.py, the name of the reading that did not fit
_MEASURED = {
    "turned": "the sides",
    "mount-moved": "the mean force to the side",
    "odd-left": "force to the left",
    "odd-up": "force up",
    "odd-pitch": "pitch",
}
_ROWS = "offset, g", "slope", "gyro bias, deg/s", "left", "up", "forward"  # of the calibration
_FULL_SCALE = 32768  # counts at the end of the range
_SUPPORTED = 2  # kind of a sensor that the firmware supports, see diagnosis.py of the firmware

# Prints what the running app noticed, which a soft reset removes: see App and lean/consistency.py of the firmware
_NOTICED = """
import sys
app, judge = [sys.modules.get("kickstand." + name) for name in ("app", "lean.consistency")]
worst = app and app.worst
if worst:
    worst = worst[0], worst[1], (tuple(worst[2][0]), worst[2][1])
print(repr((worst, judge and judge.last_odd)))
"""
# Shows the number of each wiring on a character display. Each number is sent with its own wiring, so the user can read
# only the number of the display's real wiring.
WIRINGS = """
from time import sleep_ms
from kickstand.settings import load
for number in range(1, 5):
    lcd = load().open_lcd(number)
    lcd.show("This is readable", "LCD_WIRING = %d" % number)
    lcd.flush()
    print("%13sLCD_WIRING = %d is shown for 4 s" % ("", number))
    sleep_ms(4000)
    lcd.show("", "")  # blank the display now, because it may not react to the next wiring
    lcd.flush()
print("%13sput the line that it has shown into config.py; if it has shown none: its contrast, or 5 V" % "")
"""
_WORST = (int, int, ((int, int, int), float))

Devices = list[tuple[int, str, int]]  # address, name and kind of each device on a bus
Noticed = tuple[Any, Any]  # what the app noticed: its `worst`, and the last misfit of its readings; each may be None


def status(port: Port, wirings: bool = False) -> str:
    """Run kickstand.status() on the board, restart the board, and return the report in words.

    wirings: also try each wiring of an LCD backpack on the display. Raises InputError if the board returns no status.
    """
    noticed: Noticed = (None, None)

    def ask_first(transport: SerialTransport) -> None:
        nonlocal noticed
        shapes = ((worst, odd) for worst in (_WORST, None) for odd in (str, None))  # each of the two may be None
        noticed = literal(transport.exec(_NOTICED), *shapes)

    with connected(port, ask_first) as (transport, name):
        describe(transport, name)
        try:
            code = "import kickstand\nkickstand.status()"
            text = printed(transport, name, code + WIRINGS * wirings, "its status").decode(errors="replace")
        finally:
            restart(transport)
    return words(text, noticed)


def words(text: str, noticed: Noticed = (None, None)) -> str:
    """Return the report for the output of kickstand.status(). Lines that are not facts stay."""
    text = text.replace("\r\n", "\n").rstrip()
    facts, others = {}, []
    try:
        for line in text.split("\n"):
            name, _, values = line.partition(" ")
            if name in vars(_Report):
                facts[name] = tuple(ast.literal_eval(values))
            else:
                others.append(line)
        if any(noticed):
            facts["noticed"] = noticed
        report = _Report(facts)
        parts = [getattr(report, name)(*facts[name]) for name in vars(_Report) if name in facts]
        return "\n".join([line for part in parts for line in part] + others)
    except (SyntaxError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError):
        return text  # a disturbed line; the facts are better than no report


def _line(label: str, words: str) -> str:
    return f"{label:13}{words}"


def _bus(label: str, sda: int, scl: int, devices: Devices) -> str:
    names = ", ".join(f"0x{address:02x} {name}".strip() for address, name, _ in devices)
    return _line(label, f"SDA {sda}, SCL {scl}: {names or 'nothing answers'}")


class _Report:
    """Has a method for each fact of kickstand/facts.py, with the fact's name and values, in the order of the report."""

    def __init__(self, facts: dict[str, tuple[Any, ...]]) -> None:
        self._facts = facts
        self._settings: dict[str, Any] = facts["settings"][0] if "settings" in facts else {}

    def board(self, version: str, name: str, release: str) -> Iterator[str]:
        yield f"Kickstand {version} on {name}, MicroPython {release}"

    def settings(self, settings: dict[str, Any]) -> Iterator[str]:
        yield _line("Settings", "{VEHICLE}, kickstand side {SIDE}, {SAMPLE_HZ} samples per second".format(**settings))

    def refused(self, reason: str) -> Iterator[str]:
        yield _line("Settings", reason)

    def sensor(self, name: str, who_am_i: int, address: int, celsius: float, force: list[float]) -> Iterator[str]:
        ranges = "+-{ACCEL_RANGE_G} g, +-{GYRO_RANGE_DPS} deg/s".format(**self._settings)
        yield _line("Sensor", f"{name} ({hex(who_am_i)}), {ranges}, {celsius:.1f} C")
        if address != self._settings["SENSOR_ADDRESS"]:
            words = f"it answers at {hex(address)} and is used; SENSOR_ADDRESS = {hex(address)} in config.py"
            yield _line("", words + " looks there first")
        yield _line("Reading", " ".join(f"{value:.3f}" for value in force) + " g")

    def fault(self, reason: str) -> Iterator[str]:
        devices = () if "sensor" in self._facts or self._settings["one_bus"] else self._devices("display_bus")
        for address, _, kind in devices:
            if kind == _SUPPORTED:
                pins = "SDA {SENSOR_SDA} and SCL {SENSOR_SCL}".format(**self._settings)
                reason = f"it answers at 0x{address:02x} on the wires of the display: connect it to {pins}"
        yield _line("Sensor", reason)

    def sensor_bus(self, sda: int, scl: int, devices: Devices, fault: str) -> Iterator[str]:
        yield _bus("Sensor bus", sda, scl, devices)

    def axes(self, *fault: str) -> Iterator[str]:
        yield _line("Axes", ", ".join(fault) or "all six measure")

    def display(self, address: int | None, draws: bool) -> Iterator[str]:
        if address:
            yield _line("Display", f"{'OLED' if draws else 'LCD'} at {hex(address)}")

    def display_bus(self, sda: int, scl: int, devices: Devices, fault: str) -> Iterator[str]:
        """Yield the lines about the bus of the display, and the reason if the display does not answer."""
        one_bus, (address, _) = self._settings["one_bus"], self._facts["display"]
        if not (address and one_bus):
            yield _bus("Display bus", sda, scl, devices)
        if address:
            return
        words = fault or "none answers: check wiring and LCD_ADDRESSES"
        for other, name, _ in () if one_bus else self._devices("sensor_bus"):
            if name == "display" and other in self._settings["LCD_ADDRESSES"]:
                words = f"it answers at 0x{other:02x} on the wires of the sensor: connect it to "
                words += "SDA {LCD_SDA} and SCL {LCD_SCL}, or set LCD_SDA = {SENSOR_SDA} and LCD_SCL = {SENSOR_SCL} "
                words = (words + "in config.py").format(**self._settings)
        yield _line("Display", words)

    def button(self, pressed: bool) -> Iterator[str]:
        yield _line("Button", f"GPIO {self._settings['BUTTON_PIN']}, {'pressed' if pressed else 'not pressed'}")

    def speed(self, source: str, fault: tuple[str, ...], mps: float) -> Iterator[str]:
        if not source:
            yield _line("Speed", "no source: SPEED is not set, alignment by driving is off")
            return
        gps = "GPS on UART {GPS_UART}, RX {GPS_RX}, {GPS_BAUD} baud:"
        wheel = "wheel on GPIO {WHEEL_PIN}, {PULSES_PER_METRE:.2f} pulses a metre:"
        yield _line("Speed", (gps if source == "gps" else wheel).format(**self._settings))
        yield "  " + (", ".join(fault) or ("nothing yet" if mps < 0 else f"{mps:.1f} m/s"))

    def calibration(
        self, six_done: bool | None, aligned: bool, by_drive: bool, record: str, rows: list[tuple[float, ...]]
    ) -> Iterator[str]:
        if six_done is None:
            yield _line("Calibration", "not looked at: it belongs to a sensor")
            return
        done = ("yes, by driving" if by_drive else "yes") if aligned else "no"
        yield _line("Calibration", f"six positions: {'yes' if six_done else 'no'}, aligned: {done}; {record}")
        for name, row in zip(_ROWS, rows, strict=True):
            yield f"  {name:17}" + " ".join(f"{value:9.4f}" for value in row)

    def slow(self, functions: str) -> Iterator[str]:
        yield _line("Machine code", f"not used for {functions}: slower code runs instead" if functions else "used")

    def noticed(self, worst: Any, odd: str | None) -> Iterator[str]:
        if odd:
            words = f"the readings did not fit, again and again: {_MEASURED[odd]}. Check SIDE, the order of the"
            yield _line("Sensor odd", words + " presses and the mount, and align again; then the sensor")
        if worst:
            longest_us, places, (peaks, share) = worst
            words = f"longest turn {longest_us / 1000:.1f} ms; places left in the FIFO, at the fewest: {places}"
            yield _line("Since start", words)
            accel_g = self._settings.get("ACCEL_RANGE_G", 0)
            force = " ".join(f"{peak * accel_g / _FULL_SCALE:.1f}" for peak in peaks)
            words = f"largest force {force} g of {accel_g}; {100 * share:.2f} % of the readings lost at the end"
            yield _line("Vibration", words + " of the range")

    def memory(self, free: int, flash_free: int, write_ms: int) -> Iterator[str]:
        words = f"{free // 1024} KB free; flash {flash_free // 1024} KB free, {write_ms} ms to write a block"
        yield _line("Memory", words)

    def _devices(self, bus: str) -> Devices:
        return self._facts[bus][2]
