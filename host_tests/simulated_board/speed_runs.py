"""Runs the firmware's speed sources on the simulated board, or with wires that the test moves. Runs on MicroPython."""

from kickstand_sim.simulated_board.simulator import Board
from support.board_access import level

STEP_US = 10_000


def later(days):
    """Return the value of ticks_ms() this time after it was 1000."""
    return (1000 + round(86_400_000 * days)) & 0x3FFFFFFF


class Wire:
    """A UART that delivers `data`, at most `piece` bytes per read."""

    def __init__(self, data=b"", piece=1000):
        self.data = data
        self.piece = piece

    def any(self):
        return min(self.piece, len(self.data))

    def read(self, count):
        data, self.data = self.data[:count], self.data[count:]
        return data or None


class Contact:
    """A pin whose contact the test closes (0) and opens (1)."""

    def __init__(self):
        self.level = 1
        self.handler = None

    def irq(self, handler=None, *_trigger, **_kind):
        self.handler = handler

    def value(self):
        return self.level

    def set(self, level):
        self.level = level
        if self.handler:
            self.handler(self)


def busy_with_transfers():
    """Return turn(number), which simulates an ESP32's SoftI2C transfers. Call turn(number) in each pass of the loop.

    The sensor's transfer takes 1.3 ms in each pass. The display's transfers take 12 ms every 100 ms.
    """
    from machine import Pin, SoftI2C  # type: ignore[import-not-found]

    sensor = SoftI2C(Pin(22), Pin(21), freq=250_000)
    lcd = SoftI2C(Pin(19), Pin(18), freq=100_000)
    frames, line = bytearray(30), bytes(68)

    def turn(number):
        sensor.readfrom_mem_into(0x68, 0x74, frames)
        if number % 10 < 2:
            lcd.writeto(0x27, line)

    return turn


def drive(config, fit, until_s, port="rp2"):
    """Run the firmware's Speed. On an ESP32, transfers to sensor and display run at the same time.

    Returns:
        speeds: [(t_s, speed in m/s, age_us), ...].
        faults: {t_s: the fault's lines on the display, or None}, one per second.
    """
    board = Board(level, port=port)
    fit(board)
    speeds, faults = [], {}

    def firmware():
        from time import sleep_us, ticks_ms  # type: ignore[attr-defined]

        from kickstand.board import port as of_board
        from kickstand.settings import Settings
        from kickstand.speed import source
        from kickstand.ui.messages import lines

        class Config:
            pass

        for name, value in [("WHEEL_PIN", board.wheel_pin)] + list(config.items()):
            setattr(Config, name, value)
        hard, of_board.PIN_IRQ = of_board.PIN_IRQ, {"hard": True} if port == "rp2" else {}
        speed = source.open_speed(Settings(Config), [])
        of_board.PIN_IRQ = hard
        transfer = busy_with_transfers() if port == "esp32" else lambda number: None
        turn = 0
        while True:
            transfer(turn)
            value = speed.poll(ticks_ms())
            if value is not None:
                speeds.append((board.clock.now_us / 1e6, value, speed.age_us))
            if turn % 100 == 0:
                fault = speed.source.fault(ticks_ms())
                faults[turn // 100] = None if fault is None else lines(fault)
            turn += 1
            sleep_us(STEP_US - board.clock.now_us % STEP_US)

    with board:
        board.run(firmware, until_s)
    return speeds, faults
