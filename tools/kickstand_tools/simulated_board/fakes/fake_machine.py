"""MicroPython's `machine` on the simulated board: as much of it as the firmware may use, with the ports' errors."""

from ..clock import Reset
from . import current
from .pins import Pin
from .sd_card import SPI
from .serial_buses import I2C, UART, SoftI2C

__all__ = ["I2C", "SPI", "UART", "Pin", "SoftI2C"]

PWRON_RESET = 1
WDT_RESET = 3  # the rp2 port reports this after machine.reset() too

_RP2_MAX_WATCHDOG_MS = 8388
_ESP32_TICKS = 4  # of its watchdog's second stage in a millisecond, counted in 32 bits (ESP-IDF)
_WATCHDOG_CTRL_CLEAR = 0x40058000 + 0x3000  # RP2040: writing bit 30 here stops the watchdog
_WATCHDOG_ENABLE = 1 << 30


class WDT:
    """machine.WDT. timeout in ms."""

    def __init__(self, id=0, timeout=5000):
        if current.board.port == "rp2" and timeout > _RP2_MAX_WATCHDOG_MS:
            raise ValueError("timeout exceeds %d" % _RP2_MAX_WATCHDOG_MS)
        if current.board.port == "esp32":
            timeout = (timeout * _ESP32_TICKS & 0xFFFFFFFF) // _ESP32_TICKS
        current.board.watchdog.start(timeout * 1000)

    def feed(self):
        current.board.watchdog.feed()


class Timer:
    """machine.Timer: its callback runs within whichever call lets the time pass. period in ms."""

    ONE_SHOT, PERIODIC = 0, 1

    def __init__(self, id=-1, **settings):
        self._round = 0
        if settings:
            self.init(**settings)

    def init(self, mode=PERIODIC, freq=-1, period=-1, callback=None):
        period_us = int(1000000 / freq) if freq > 0 else period * 1000
        self.deinit()
        mine, boot = self._round, current.board.boots

        def fire():
            if self._round != mine or current.board.boots != boot:
                return
            if mode == Timer.PERIODIC:
                current.board.clock.at(current.board.clock.now_us + period_us, fire)
            if callback:
                callback(self)

        current.board.clock.at(current.board.clock.now_us + period_us, fire)

    def deinit(self):
        self._round += 1


class _Mem32:
    """machine.mem32: memory that only stores words, except for the register that stops the watchdog."""

    def __init__(self):
        self._words = {}

    def __getitem__(self, address):
        return self._words.get(address, 0)

    def __setitem__(self, address, value):
        if address == _WATCHDOG_CTRL_CLEAR and value & _WATCHDOG_ENABLE:
            current.board.watchdog.stop()
        self._words[address] = value


mem32 = _Mem32()


def reset():
    raise Reset


def reset_cause():
    return current.board.reset_cause
