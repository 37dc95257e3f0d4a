"""The simulated board: pins of a microcontroller, MPU6050, display and button, wired together on one clock.

    with Board(world) as board:
        board.press(2.0)
        board.run(main, until_s=10)    # "off", "reset" or "returned"
        board.lcd.text()

Within the `with` statement, `machine`, `time` and `os` act on this board. Import the firmware there.
"""

from .clock import Clock, PowerOff, Reset, Watchdog, to_us
from .contacts import Button, Wheel
from .fakes import chips, fake_machine, fake_time
from .fakes.installer import Installer
from .faults import Faults
from .gps import Gps
from .i2c import Bus
from .lcd import Lcd
from .mpu6050 import Mpu6050
from .oled import Oled
from .radio import Radio
from .sd_card import SdCard

__all__ = ["Board", "PowerOff", "Reset"]

# The firmware's default pins: (SDA, SCL) of the sensor, (SDA, SCL) of the display, button, GPS (RX), wheel
WIRING = {"rp2": ((4, 5), (6, 7), 15, 9, 14), "esp32": ((21, 22), (18, 19), 4, 16, 27)}


class Board:
    """A board. It is off until run() switches it on.

    Times in seconds refer to the board's clock, which continues through resets and power cycles.

    world: function world(t_s) that returns (fx, fy, fz, wx, wy, wz[, temp_c]) in g and deg/s along the chip's axes. The
        values include the chip's errors.
    who_am_i: the fitted chip.
    display: "lcd", "ssd1306" or "sh1106".
    sensor_address, lcd_address: the addresses. None: not fitted. 0 for the display: its usual address.
    one_bus: True if the display is on the sensor's wires.
    port: "rp2" or "esp32".
    clock: None for a new Clock, which runs as fast as possible.
    machine: a name in chips.MACHINES, which determines the port. Firmware that is first imported after install() sees
        this board. Without `machine`, it sees the board that it was imported for, usually a Pico.
    i2c_driver: driver of MicroPython on an ESP32, "new" or (up to version 1.28) "legacy".
    sensor_pins, lcd_pins: (SDA, SCL). None for the pins in WIRING.
    touched: the pins that the firmware has used so far.
    volts: {pin number: voltage at this pin of an ADC}.
    sent: the bytes that were written to UARTs.
    """

    def __init__(
        self,
        world,
        who_am_i=0x68,
        sensor_address=0x68,
        lcd_address=0,
        one_bus=False,
        port="rp2",
        seed=1,
        machine=None,
        i2c_driver="new",
        sensor_pins=None,
        lcd_pins=None,
        button_pin=None,
        display="lcd",
        clock=None,
    ):
        self.poses = machine is not None
        self.machine = chips.MACHINES[machine or ("pico" if port == "rp2" else "esp32")]
        self.port = port = "esp32" if "ESP32" in self.machine else "rp2"
        self.i2c_driver = i2c_driver
        self.pins = chips.pins_of(self.machine)
        self.touched = set()
        self.volts = {}
        self.sent = b""
        self.seed = seed
        self.clock = clock or Clock()
        self.sensor = Mpu6050(self.clock, world, who_am_i, sensor_address or 0x68)
        self.lcd = self._display(display, lcd_address)
        self.button = Button(self.clock, seed)
        self.watchdog = Watchdog(self.clock)
        usual_sensor, usual_lcd, usual_button, self._gps_pin, self.wheel_pin = WIRING[port]
        self.button_pin = usual_button if button_pin is None else button_pin
        self.radio = Radio(self.clock, port == "esp32") if chips.has_bluetooth(self.machine) else None
        self.gps = self.wheel = self.card = None  # a Gps, a Wheel, an SdCard, if fitted
        self.sensor_bus = Bus(self.clock, *(sensor_pins or usual_sensor))
        self.lcd_bus = self.sensor_bus if one_bus else Bus(self.clock, *(lcd_pins or usual_lcd))
        self.buses = [self.sensor_bus] if one_bus else [self.sensor_bus, self.lcd_bus]
        self._wires = {}  # the functions of each wire that return and set its level, by the number of the pin
        for bus in self.buses:
            self._wires[bus.sda], self._wires[bus.scl] = (bus.sda_level, bus.set_sda), (bus.scl_level, bus.set_scl)
        self.too_fast = False  # True after a bus was clocked faster than one of its devices allows
        self.faults = Faults(self)
        self.boots = 0
        self.ticks_at_boot_us = 0  # first value of ticks_us(); a value near 1 << 30 makes ticks wrap soon
        self.reset_cause = fake_machine.PWRON_RESET
        self.processor_hz = 160_000_000  # what the board starts with
        self._off = True
        self._pins = {}  # number: [mode, pull, driven level, time of first use]
        # Pins of an RP2350 that were high. Such a pin stays high against its pull-down (erratum RP2350-E9)
        self._high = set()
        self._fakes = Installer()
        if sensor_address is not None:
            self.fit_sensor()
        if lcd_address is not None:
            self.fit_lcd()

    def install(self):
        self._fakes.install(self)

    def uninstall(self):
        self.faults.restore("open", "print")
        self._fakes.uninstall()

    def __enter__(self):
        self.install()
        return self

    def __exit__(self, *_):
        self.uninstall()

    def run(self, function, until_s):
        """Call function(). Returns "returned", "reset", or "off" if the power was cut at until_s.

        After "off", the next run() starts everything from power-on. After "reset", only the microcontroller restarts.
        """
        if self._off:
            self.reset_cause = fake_machine.PWRON_RESET
            self.power_on()
        self.boots += 1
        self._pins = {}
        for bus in self.buses:
            bus.release()
        fake_time.use(self.clock, self.clock.now_us - self.ticks_at_boot_us)
        self.clock.set_deadline(to_us(until_s))
        try:
            function()
            return "returned"
        except PowerOff:
            self.power_off()
            return "off"
        except Reset:
            self.reset_cause = fake_machine.WDT_RESET
            return "reset"
        finally:
            self.clock.set_deadline(None)
            self.watchdog.stop()
            for part in (self.button, self.gps, self.wheel):
                if part:
                    part.connect(None)

    def power_on(self):
        self._off = False
        self.sensor.power_on()
        self.lcd.power_on()

    def power_off(self):
        self._off = True
        if self.radio:
            self.radio.off()
        for bus in self.buses:
            bus.power_off()
        self.lcd.power_off()

    def run_firmware(self, until_s, **config):
        """Run the firmware with these settings of config.py, as run() does. Call it within the `with` statement."""
        from kickstand import settings, start

        load = settings.load
        settings.load = lambda: settings.Settings(type("Config", (), config))
        try:
            return self.run(start.main, until_s)
        finally:
            settings.load = load

    def at(self, t_s, function):
        self.clock.at(to_us(t_s), function)

    def every(self, period_s, function):
        self.clock.every(to_us(period_s), function)

    def press(self, at_s=None, for_s=0.15):
        """Press the button for for_s, at the time at_s. None presses it now, or after a press still scheduled."""
        self.button.press(None if at_s is None else to_us(at_s), to_us(for_s))

    # Parts that are connected and disconnected

    def fit_sensor(self):
        self.sensor.power_on()
        self.sensor_bus.attach(self.sensor)

    def remove_sensor(self):
        self.sensor_bus.detach(self.sensor)

    def fit_lcd(self):
        self.lcd.power_on()
        self.lcd_bus.attach(self.lcd)

    def _display(self, kind, address=0):
        if kind == "lcd":
            return Lcd(self.clock, address or 0x27)
        return Oled(self.clock, address or 0x3C, kind)

    def change_display(self, kind):
        self.remove_lcd()
        self.lcd = self._display(kind)
        self.fit_lcd()

    def remove_lcd(self):
        self.lcd_bus.detach(self.lcd)
        self.lcd.power_off()

    def fit_gps(self, speed, **kind):
        """Connect a GPS receiver. speed(t_s): speed of the vehicle in m/s. kind: further arguments of Gps."""
        self.gps = Gps(self.clock, speed, **kind)

    def fit_wheel(self, speed, **kind):
        """Connect a wheel contact. speed(t_s): speed of the vehicle in m/s. kind: further arguments of Wheel."""
        self.wheel = Wheel(self.clock, speed, **kind)

    def fit_card(self, **kind):
        """Connect an SD card. Call this before install() to have the driver on the board. kind: arguments of SdCard."""
        self.card = SdCard(self.clock, **kind)

    # Called by the fake `machine`

    def connect_uart(self, pin, baud, receive):
        """Call receive(bytes) with the bytes that arrive on this pin. At a wrong baud rate they are noise."""
        if self.gps and pin == self._gps_pin:
            is_same_rate = baud == self.gps.baud
            self.gps.connect(receive if is_same_rate else lambda data: receive(bytes([b & 0xE6 for b in data])))

    def watch_pin(self, number, edge):
        """Call edge(level) when the part wired to this pin changes its level. None ends the calls."""
        if number == self.button_pin:
            self.button.connect(edge)
        if self.wheel and number == self.wheel_pin:
            self.wheel.connect(edge)

    def bus_on(self, sda, scl, hz):
        """Return the bus on these pins, clocked at hz from now on. A bus on pins without wires has no devices."""
        self.touched.update((sda, scl))
        for bus in self.buses:
            if (bus.sda, bus.scl) == (sda, scl):
                bus.release()
                if hz > bus.max_hz():
                    self.too_fast = True
                return bus
        return Bus(self.clock, sda, scl)

    def set_up_pin(self, number, mode, pull, level):
        self.touched.add(number)
        self._pins.setdefault(number, [0, 0, 0, self.clock.now_us])[:3] = mode, pull, level or 0
        self._drive_wire(number, 1 if mode == fake_machine.Pin.IN else level or 0)

    def drive_pin(self, number, level):
        """Execute Pin.value(level). A pin in mode IN drives this level only after its mode becomes OUT."""
        pin = self._pins.setdefault(number, [fake_machine.Pin.IN, -1, 0, 0])
        pin[2] = level
        if pin[0] != fake_machine.Pin.IN:
            self._drive_wire(number, level)

    def pin_level(self, number):
        mode, pull = self._pins.get(number, (fake_machine.Pin.IN, -1))[:2]
        level = self._level(number)
        if number in self._high and mode == fake_machine.Pin.IN and pull == fake_machine.Pin.PULL_DOWN:
            return 1
        self._note_high(number, level)
        return level

    def _note_high(self, number, level):
        if level and "RP2350" in self.machine:
            self._high.add(number)
        else:
            self._high.discard(number)

    def _level(self, number):
        mode, pull, level, since_us = self._pins.get(number, (fake_machine.Pin.IN, -1, 0, 0))
        if number in self._wires:
            return self._wires[number][0](pull == fake_machine.Pin.PULL_UP)
        if number == self.button_pin and self.button.low(since_us):
            return 0
        if number == self.wheel_pin and self.wheel and self.wheel.closed:
            return 0
        if mode == fake_machine.Pin.IN:
            return 1 if pull == fake_machine.Pin.PULL_UP else 0  # a floating pin reads low here
        return level

    def _drive_wire(self, number, level):
        if not level:
            self._note_high(number, 0)
        if self.card and number == self.card.cs:
            self.card.select(level)
        if number in self._wires:
            self._wires[number][1](level)
