"""The simulated board: microcontroller pins, MPU6050, LCD and button, wired together on one clock.

    board = Board(world)
    board.install()
    board.press(2.0)
    board.run(main, until_s=10)    # "off", "reset" or "returned"
    board.lcd.text()
    board.uninstall()

Import the firmware after the first install(): under MicroPython `time`, `os` and `machine` are replaced there.
"""

import os
import sys
import time

from .button import Button
from .clock import Clock, PowerOff, Reset, to_us
from .fakes import fake_machine, fake_os, fake_time
from .faults import Faults
from .gps import Gps
from .i2c import Bus
from .lcd import Lcd
from .mpu6050 import Mpu6050
from .watchdog import Watchdog
from .wheel import Wheel

__all__ = ["Board", "PowerOff", "Reset"]

# Pins (SDA, SCL) of the sensor's and of the LCD's bus, of the button, of GPS and wheel: as the firmware's defaults
WIRING = {"rp2": ((4, 5), (6, 7), 15, 9, 14), "esp32": ((21, 22), (18, 19), 4, 16, 27)}
_ADDED_TO = ((time, fake_time), (os, fake_os))  # under CPython


class Board:
    """A board with its supply off; run() switches it on.

    world(t_s): (fx, fy, fz, wx, wy, wz[, temp_c]) as the chip's own axes feel it, with its errors: g, deg/s.
    who_am_i: which chip is fitted.  sensor_address, lcd_address: None where there is none.
    one_bus: the LCD on the sensor's wires.  port: "rp2" or "esp32".  pace: 1.0 for real time, 0 never waits.
    Times in seconds are those of the board's clock, which goes on over resets and power cycles.
    """

    def __init__(
        self,
        world,
        who_am_i=0x68,
        sensor_address=0x68,
        lcd_address=0x27,
        one_bus=False,
        port="rp2",
        seed=1,
        pace=0.0,
    ):
        self.port = port
        self.seed = seed
        self.clock = Clock(pace)
        self.sensor = Mpu6050(self.clock, world, who_am_i, sensor_address or 0x68)
        self.lcd = Lcd(self.clock, lcd_address or 0x27)
        self.button = Button(self.clock, seed)
        self.watchdog = Watchdog(self.clock)
        sensor_pins, lcd_pins, self._button_pin, self._gps_pin, self.wheel_pin = WIRING[port]
        self.gps = None  # a Gps and a Wheel, where fitted
        self.wheel = None
        self.sensor_bus = Bus(self.clock, *sensor_pins)
        self.lcd_bus = self.sensor_bus if one_bus else Bus(self.clock, *lcd_pins)
        self.buses = [self.sensor_bus] if one_bus else [self.sensor_bus, self.lcd_bus]
        self.too_fast = False  # a bus was run faster than a device on it stands
        self.faults = Faults(self)
        self.boots = 0
        self.ticks_at_boot_us = 0  # to see ticks wrap, near 1 << 30
        self.reset_cause = fake_machine.PWRON_RESET
        self._off = True
        self._pins = {}  # number: [mode, pull, level driven]
        self._real = {}  # modules that install() replaced
        if sensor_address is not None:
            self.fit_sensor()
        if lcd_address is not None:
            self.fit_lcd()

    def install(self):
        """Make this board what `machine`, `time` and `os` mean to code from now on."""
        fake_machine.use(self)
        fake_time.use(self.clock, self.clock.now_us)
        self._replace("machine", fake_machine)
        if sys.implementation.name == "micropython":
            self._replace("time", fake_time)
            self._replace("os", fake_os)
        else:
            from .fakes import cpython  # what it needs MicroPython has not

            cpython.supplement()
            for real, fake in _ADDED_TO:
                for name in fake.ADDED:
                    setattr(real, name, getattr(fake, name))

    def uninstall(self):
        """Undo install()."""
        self.faults.restore_files()
        for name, module in self._real.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module
        self._real = {}
        if sys.implementation.name != "micropython":
            for real, fake in _ADDED_TO:
                for name in fake.ADDED:
                    if hasattr(real, name):
                        delattr(real, name)

    def run(self, function, until_s):
        """Call function(): "returned", or "reset", or "off" if until_s came first, when the supply is cut.

        After "off" the next run() is a cold start of everything; after "reset" of the microcontroller alone.
        """
        if self._off:
            self._off = False
            self.reset_cause = fake_machine.PWRON_RESET
            self.sensor.power_on()
            self.lcd.power_on()
        self.boots += 1
        self._pins = {}
        for bus in self.buses:
            bus.set_scl(1)
            bus.set_sda(1)
        fake_time.use(self.clock, self.clock.now_us - self.ticks_at_boot_us)
        self.clock.set_deadline(to_us(until_s))
        try:
            function()
            return "returned"
        except PowerOff:
            self._off = True
            for bus in self.buses:
                bus.power_off()
            self.lcd.power_off()
            return "off"
        except Reset:
            self.reset_cause = fake_machine.WDT_RESET
            return "reset"
        finally:
            self.clock.set_deadline(None)
            self.watchdog.stop()
            if self.gps:
                self.gps.disconnect()
            if self.wheel:
                self.wheel.disconnect()

    def at(self, t_s, function):
        """Call function() when the clock reaches t_s."""
        self.clock.at(to_us(t_s), function)

    def every(self, period_s, function):
        """Call function() every period_s."""
        self.clock.every(to_us(period_s), function)

    def press(self, at_s=None, for_s=0.15):
        """Press the button at at_s (now, if None) for for_s."""
        self.button.press(self.clock.now_us if at_s is None else to_us(at_s), to_us(for_s))

    # Soldering

    def fit_sensor(self):
        """As new: its supply comes up now."""
        self.sensor.power_on()
        self.sensor_bus.attach(self.sensor)

    def remove_sensor(self):
        """Gone from the bus."""
        self.sensor_bus.detach(self.sensor)

    def fit_lcd(self):
        """As new: its supply comes up now."""
        self.lcd.power_on()
        self.lcd_bus.attach(self.lcd)

    def remove_lcd(self):
        """Gone from the bus, and dark."""
        self.lcd_bus.detach(self.lcd)
        self.lcd.power_off()

    def fit_gps(self, speed, **kind):
        """A receiver on its pin. speed(t_s): of the vehicle, m/s; kind: as for Gps."""
        self.gps = Gps(self.clock, speed, **kind)

    def fit_wheel(self, speed, **kind):
        """A contact at a wheel on its pin. speed(t_s): of the vehicle, m/s; kind: as for Wheel."""
        self.wheel = Wheel(self.clock, speed, **kind)

    # What fake_machine needs

    def connect_uart(self, pin, baud, receive):
        """What arrives on this pin goes to receive(bytes): noise, if the receiver sends at another rate."""
        if self.gps and pin == self._gps_pin:
            same = baud == self.gps.baud
            self.gps.connect(receive if same else lambda data: receive(bytes([b & 0xE6 for b in data])))

    def watch_pin(self, number, edge):
        """Call edge(level) when what is wired to this pin changes it."""
        if self.wheel and number == self.wheel_pin:
            self.wheel.connect(edge)

    def bus_on(self, sda, scl, hz):
        """The bus on these pins, driven by a controller at hz from now on; an empty one if none is wired."""
        for bus in self.buses:
            if (bus.sda, bus.scl) == (sda, scl):
                bus.set_scl(1)
                bus.set_sda(1)
                if hz > bus.max_hz():
                    self.too_fast = True
                return bus
        return Bus(self.clock, sda, scl)

    def set_up_pin(self, number, mode, pull, level):
        """Pin.init()."""
        self._pins[number] = [mode, pull, level or 0]
        self._drive_wire(number, 1 if mode == fake_machine.Pin.IN else level or 0)

    def drive_pin(self, number, level):
        """Pin.value(level). A pin in mode IN keeps the level for later, as on the chip."""
        pin = self._pins.setdefault(number, [fake_machine.Pin.IN, -1, 0])
        pin[2] = level
        if pin[0] != fake_machine.Pin.IN:
            self._drive_wire(number, level)

    def pin_level(self, number):
        """Pin.value()."""
        for bus in self.buses:
            if number == bus.sda:
                return bus.sda_level()
            if number == bus.scl:
                return bus.scl_level()
        mode, pull, level = self._pins.get(number, (fake_machine.Pin.IN, -1, 0))
        if number == self._button_pin and self.button.closed:
            return 0
        if number == self.wheel_pin and self.wheel and self.wheel.closed:
            return 0
        if mode == fake_machine.Pin.IN:
            return 1 if pull == fake_machine.Pin.PULL_UP else 0  # a floating pin is taken to read low
        return level

    def _drive_wire(self, number, level):
        for bus in self.buses:
            if number == bus.sda:
                bus.set_sda(level)
            elif number == bus.scl:
                bus.set_scl(level)

    def _replace(self, name, module):
        if name not in self._real:
            self._real[name] = sys.modules.get(name)
        sys.modules[name] = module
