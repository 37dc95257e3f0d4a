"""The facts about a board, its settings and what is wired to it, for kickstand.status() and `kickstand check`.

Each fact is a line: a name and a tuple of values. The tools on the computer have the words for the values.
"""

import gc
import os
import sys
from time import sleep_ms, ticks_diff, ticks_ms

from .board.display import LCD_HZ
from .calibration.store import Store
from .console import sentence
from .diagnosis import MOTION_ADDRESSES, fifo_fault, scan
from .errors import SettingsError
from .imu.mpu6050 import UnknownChip
from .settings import load
from .ui.messages import lines
from .units import __version__, const

_LISTEN_MS = const(3500)  # each fault of a speed source is detected within this time
_WATCH_MS = const(1400)  # time to set the sensor up and judge its axes twice
_TRIAL = "trial.tmp"  # a file that is written to measure the flash, and then removed


def report():
    """Print all facts. Stop the app first, because this function opens sensor and display."""
    print("board", board())
    try:
        settings = load()
        print("settings", (settings.__dict__,))
        chip = _sensor(settings)
        print("sensor_bus", bus(settings, "SENSOR", MOTION_ADDRESSES))
        lcd = settings.open_lcd()
        lcd.show("Kickstand", "status: console")
        lcd.flush()
        print("display", (lcd.address, lcd.draws))
        print("display_bus", bus(settings, "LCD", settings.LCD_ADDRESSES))
        print("button", (settings.open_button().held(),))
        print("speed", speed(settings))
    except SettingsError as error:
        print("refused", (sentence(error),))
        return
    print("calibration", _calibration(chip, settings) if chip else (None, None, None, "", []))
    print("slow", (slow_functions(),))
    app, judge = sys.modules.get("kickstand.app"), sys.modules.get("kickstand.lean.consistency")
    print("noticed", (app and app.worst, judge and judge.last_odd))
    write_ms = _write_ms()
    gc.collect()
    space = os.statvfs("/")
    print("memory", (gc.mem_free(), space[0] * space[3], write_ms))


def board():
    """Return (version of the firmware, name of the board, version of MicroPython)."""
    release = ".".join([str(n) for n in sys.implementation.version[:3]])
    return __version__, getattr(sys.implementation, "_machine", sys.platform), release


def slow_functions():
    """Return the names of the functions that do not run as machine code, separated by commas."""
    from .calibration import parameters  # noqa: F401 loads a function
    from .quick import plain
    from .rides import block  # noqa: F401 loads a function

    return ", ".join(plain)


def bus(settings, name, addresses):
    """Examine a bus.

    Args:
        name: the beginning of the names of the bus's settings.
        addresses: the addresses of the part that belongs to the bus.

    Returns:
        SDA, SCL.
        devices: list of (address, name, kind), see diagnosis.scan().
        fault: the fault of the wires as a sentence, or an empty text.
    """
    sda, scl = getattr(settings, name + "_SDA"), getattr(settings, name + "_SCL")
    hz = getattr(settings, name + "_BUS_HZ") or LCD_HZ
    notice, devices = scan(sda, scl, lambda: settings.open_bus(name, hz), addresses)
    return sda, scl, devices, sentence(notice) if notice else ""


def _sensor(settings):
    """Print the facts about the sensor. Return its Mpu6050, or None without a usable sensor."""
    sensor = settings.open_sensor()
    chip = sensor.chip
    try:
        sensor.set_up()
        chip.read()
        force = [chip.counts[i] / chip.accel_lsb_per_g for i in range(3)]
        print("sensor", (chip.name, chip.who_am_i, chip.address, chip.temperature_c(chip.counts[3]), force))
        fault = fifo_fault(chip)
    except (UnknownChip, OSError) as error:
        fault, chip = sensor.explain(chip, error)[0], None
    if fault:
        print("fault", (sentence(fault),))
    if chip:
        for _ in range(_WATCH_MS // 10):
            sensor.fetch(ticks_ms())
            sleep_ms(10)
        print("axes", lines(sensor.fault) if sensor.fault else ())
    return chip


def speed(settings):
    """Listen to the speed source.

    Returns:
        source: the setting SPEED, "" without a speed source.
        fault: two lines, or an empty tuple.
        mps: the speed in m/s, or -1 without a speed.
    """
    if settings.SPEED is None:
        return "", (), -1
    from .speed.source import open_speed

    source, mps = open_speed(settings, []), -1
    for _ in range(_LISTEN_MS // 10):
        new = source.poll(ticks_ms())
        mps = mps if new is None else new
        sleep_ms(10)
    fault = source.source.fault(ticks_ms())
    return settings.SPEED, lines(fault) if fault else (), mps


def _calibration(chip, settings):
    store = Store(chip.who_am_i, settings.ACCEL_RANGE_G)
    stored = store.load()
    rows = [stored.accel_offset, stored.accel_slope, stored.gyro_bias]
    rows += [stored.vehicle_from_sensor[k : k + 3] for k in (0, 3, 6)]
    flags = stored.six_done, stored.aligned, stored.by_drive
    return flags + (store.message, [tuple(row) for row in rows])


def _write_ms():
    """Return the time in ms to erase and write a flash block. Readings are lost if the chip's FIFO overflows during the
    erase and the write."""
    begun_ms = ticks_ms()
    with open(_TRIAL, "wb") as file:
        file.write(bytes(4096))
    took_ms = ticks_diff(ticks_ms(), begun_ms)
    os.remove(_TRIAL)
    return took_ms
