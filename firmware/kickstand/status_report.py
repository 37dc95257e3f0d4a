"""Prints the report of kickstand.status() about settings, sensor, display, speed source and calibration of a board."""

import gc
import os
import sys
from time import sleep_ms, ticks_diff, ticks_ms

from .board.display import LCD_HZ
from .calibration.store import Store
from .console import sentence
from .devices import open_bus, open_button, open_lcd, open_sensor
from .diagnosis import MOTION_ADDRESSES, bus_line, fifo_fault, scan, show_wirings
from .errors import SettingsError
from .imu.mpu6050 import UnknownChip
from .imu.other_chips import SUPPORTED
from .settings import load
from .ui import messages
from .units import __version__, const

_LISTEN_MS = const(3500)
# For each code of lean/consistency.py, the name of the reading that did not fit
MEASURED = {"odd-left": "force to the left", "odd-up": "force up", "odd-pitch": "pitch"}
_WIRINGS = const(4)  # number of values of LCD_WIRING
_WIRING_MS = const(4000)  # time for which each wiring is shown
_WATCH_MS = const(1400)  # time to set the sensor up and judge its axes twice
# What the app noticed before a soft reset that removed it, as `kickstand status` sets it: the app's `worst` and the
# `last_odd` of lean/consistency.py, or None
noticed = None
_TRIAL = "trial.tmp"  # a file that is written to measure the flash, and then removed


def _print(label, words, *values):
    print("%-13s" % label + words % values)


def report(wirings=False):
    """Print the whole report. Stop the app first, because this function opens sensor and display.

    Args:
        wirings: as for kickstand.status().
    """
    release = ".".join(str(n) for n in sys.implementation.version[:3])
    machine_name = getattr(sys.implementation, "_machine", sys.platform)
    print("Kickstand %s on %s, MicroPython %s" % (__version__, machine_name, release))
    try:
        settings = load()
        words = "%s, kickstand side %s, %d samples per second"
        _print("Settings", words, settings.VEHICLE, settings.SIDE, settings.SAMPLE_HZ)
        sensor = open_sensor(settings)
        who_am_i = _sensor(sensor, settings)
        if who_am_i:
            _axes(sensor)
        _display(open_lcd(settings), settings)
        if wirings:
            show_wirings(lambda number: open_lcd(settings, number), _WIRINGS, _WIRING_MS)
        pressed = "pressed" if open_button(settings).held() else "not pressed"
        _print("Button", "GPIO %d, %s", settings.BUTTON_PIN, pressed)
        _speed(settings)
    except SettingsError as error:
        _print("Settings", "%s", sentence(error))
        return
    _calibration(who_am_i, settings)
    _machine_code()
    _worst(sensor.chip)
    gc.collect()
    space = os.statvfs("/")
    free_kb = gc.mem_free() // 1024, space[0] * space[3] // 1024
    _print("Memory", "%d KB free; flash %d KB free, %d ms to write a block", *free_kb, _write_ms())


def _write_ms():
    """Return the time in ms to erase and write a flash block. Readings are lost if the chip's FIFO overflows during the
    erase and the write."""
    begun_ms = ticks_ms()
    with open(_TRIAL, "wb") as file:
        file.write(bytes(4096))
    took_ms = ticks_diff(ticks_ms(), begun_ms)
    os.remove(_TRIAL)
    return took_ms


def _sensor(sensor, settings):
    """Print the sensor and the other devices on its bus. Return the sensor's WHO_AM_I, or 0 without a usable sensor."""
    chip = sensor.chip
    fault = None
    try:
        sensor.set_up()
        chip.read()
        who_am_i = chip.who_am_i
        ranges = settings.ACCEL_RANGE_G, settings.GYRO_RANGE_DPS
        temperature_c = chip.temperature_c(chip.counts[3])
        _print("Sensor", "%s (%s), +-%d g, +-%d deg/s, %.1f C", chip.name, hex(who_am_i), *ranges, temperature_c)
        if chip.address != settings.SENSOR_ADDRESS:
            words = "it answers at %s and is used; SENSOR_ADDRESS = %s in config.py looks there first"
            _print("", words, hex(chip.address), hex(chip.address))
        _print("Reading", "%.3f %.3f %.3f g", *[chip.counts[i] / chip.accel_lsb_per_g for i in range(3)])
        fault = fifo_fault(chip)
    except (UnknownChip, OSError) as error:
        who_am_i = 0
        fault, _ = sensor.explain(chip, error)
    if fault:
        moved = None if who_am_i else _elsewhere(settings, "LCD", MOTION_ADDRESSES, SUPPORTED)
        words = "it answers at 0x%02x on the wires of the display: connect it to SDA %d and SCL %d"
        pins = settings.SENSOR_SDA, settings.SENSOR_SCL
        _print("Sensor", "%s", words % ((moved,) + pins) if moved else sentence(fault))
    _bus("Sensor", settings, "SENSOR", MOTION_ADDRESSES)
    return who_am_i


def _scan(settings, name, addresses):
    """Return the wires of a bus and what diagnosis.scan() finds on it: (sda, scl, notice, devices)."""
    sda, scl = getattr(settings, name + "_SDA"), getattr(settings, name + "_SCL")
    hz = getattr(settings, name + "_BUS_HZ") or LCD_HZ
    return (sda, scl) + scan(sda, scl, lambda: open_bus(settings, name, hz), addresses)


def _elsewhere(settings, name, addresses, wanted):
    """Return the address at which a part that is missing on its own bus answers on the other bus, or None.

    Args:
        name: the beginning of the names of the other bus's settings.
        addresses: the addresses of the part.
        wanted: the name or the kind that other_chips.name_of() gives the part.
    """
    if settings.one_bus:
        return None
    for address, found, kind in _scan(settings, name, addresses)[3]:
        if wanted in (found, kind):
            return address
    return None


def _axes(sensor):
    """Watch the counts of the sensor's axes for over a second, and print their faults."""
    for _ in range(_WATCH_MS // 10):
        sensor.fetch(ticks_ms())
        sleep_ms(10)
    _print("Axes", "%s", ", ".join(messages.lines(sensor.fault)) if sensor.fault else "all six measure")


def _bus(label, settings, name, addresses):
    """Print the devices on a bus, or the fault of its wires. Return the fault, a Notice or None."""
    sda, scl, notice, devices = _scan(settings, name, addresses)
    print(bus_line(label, sda, scl, devices))
    return notice


def _display(lcd, settings):
    lcd.show("Kickstand", "status: console")
    lcd.flush()
    if lcd.address:
        _print("Display", "%s at %s", "OLED" if lcd.draws else "LCD", hex(lcd.address))
    if not (lcd.address and settings.one_bus):
        notice = _bus("Display", settings, "LCD", settings.LCD_ADDRESSES)
        if not lcd.address:
            moved = _elsewhere(settings, "SENSOR", settings.LCD_ADDRESSES, "display")
            if moved:
                words = "it answers at 0x%02x on the wires of the sensor: connect it to SDA %d and SCL %d, or set "
                words += "LCD_SDA = %d and LCD_SCL = %d in config.py"
                pins = settings.LCD_SDA, settings.LCD_SCL, settings.SENSOR_SDA, settings.SENSOR_SCL
                _print("Display", words, moved, *pins)
            else:
                words = sentence(notice) if notice else "none answers: check wiring and LCD_ADDRESSES"
                _print("Display", "%s", words)


def _speed(settings):
    """Print the speed or the fault of the speed source after _LISTEN_MS. Each fault of a speed source is detected
    within _LISTEN_MS."""
    if settings.SPEED is None:
        _print("Speed", "no source: SPEED is not set, alignment by driving is off")
        return
    from .speed.source import open_speed

    speed = open_speed(settings)
    if settings.SPEED == "gps":
        _print("Speed", "GPS on UART %d, RX %d, %d baud:", settings.GPS_UART, settings.GPS_RX, settings.GPS_BAUD)
    else:
        _print("Speed", "wheel on GPIO %d, %.2f pulses a metre:", settings.WHEEL_PIN, settings.PULSES_PER_METRE)
    heard = None
    for _ in range(_LISTEN_MS // 10):
        new = speed.poll(ticks_ms())
        heard = heard if new is None else new
        sleep_ms(10)
    fault = speed.source.fault(ticks_ms())
    if fault:
        print("  " + ", ".join(messages.lines(fault)))
    else:
        print("  nothing yet" if heard is None else "  %.1f m/s" % heard)


def _worst(chip):
    """Print what the app noticed since the board started: readings that did not fit, and its worst values.

    Nothing is printed if the app has not run.

    Args:
        chip: an Mpu6050.
    """
    judge, app = sys.modules.get("kickstand.lean.consistency"), sys.modules.get("kickstand.app")
    worst, odd = noticed or (app and app.worst, judge and judge.last_odd)
    if odd:
        words = (
            "the readings did not fit, again and again: %s. Check SIDE, the order of the presses and the mount, and \
align again; then the sensor"
        )
        _print("Sensor odd", words, MEASURED[odd])
    if worst:
        longest_us, places, (peaks, share) = worst
        words = "longest turn %.1f ms; places left in the FIFO, at the fewest: %d"
        _print("Since start", words, longest_us / 1000, places)
        words = "largest force %.1f %.1f %.1f g of %d; %.2f %% of the readings lost at the end of the range"
        forces = [peak / chip.accel_lsb_per_g for peak in peaks]
        _print("Vibration", words, *(forces + [chip.accel_range_g, 100 * share]))


def _machine_code():
    from .calibration import transform  # noqa: F401 loads a function
    from .quick import plain
    from .rides import block  # noqa: F401 loads a function

    words = "not used for %s: slower code runs instead" % ", ".join(plain) if plain else "used"
    _print("Machine code", "%s", words)


def _calibration(who_am_i, settings):
    if not who_am_i:
        _print("Calibration", "not looked at: it belongs to a sensor")
        return
    store = Store(who_am_i, settings.ACCEL_RANGE_G)
    calibration = store.load()
    six = "yes" if calibration.six_done else "no"
    aligned = ("yes, by driving" if calibration.by_drive else "yes") if calibration.aligned else "no"
    _print("Calibration", "six positions: %s, aligned: %s; %s", six, aligned, store.message)
    for name, values in (
        ("offset, g", calibration.accel_offset),
        ("slope", calibration.accel_slope),
        ("gyro bias, deg/s", calibration.gyro_bias),
        ("left", calibration.vehicle_from_sensor[0:3]),
        ("up", calibration.vehicle_from_sensor[3:6]),
        ("forward", calibration.vehicle_from_sensor[6:9]),
    ):
        print("  %-17s" % name + " ".join("%9.4f" % value for value in values))
