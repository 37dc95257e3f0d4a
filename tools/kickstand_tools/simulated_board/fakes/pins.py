"""MicroPython's machine.Pin on the simulated board."""

from . import current


class Pin:
    """machine.Pin: levels, and interrupts from what is wired to the pin. Handlers run while simulated time passes."""

    IN, OUT, OPEN_DRAIN = 0, 1, 2
    PULL_UP, PULL_DOWN = 1, 2
    IRQ_FALLING, IRQ_RISING = 4, 8

    def __init__(self, id, mode=-1, pull=-1, value=None):
        self.id = id.id if isinstance(id, Pin) else id
        if self.id is None and current.board.port == "rp2":
            raise TypeError("can't convert NoneType to int")
        if self.id not in current.board.pins:
            raise ValueError("invalid pin")
        if mode != -1:
            self.init(mode, pull, value)

    def init(self, mode=-1, pull=-1, value=None):
        current.board.set_up_pin(self.id, mode, pull, 1 if value is None and mode == Pin.OPEN_DRAIN else value)

    def value(self, level=None):
        current.board.clock.advance(current.CALL_US)
        if level is None:
            return current.board.pin_level(self.id)
        current.board.drive_pin(self.id, 1 if level else 0)
        return None

    def irq(self, handler=None, trigger=IRQ_FALLING | IRQ_RISING, **hard):
        if hard and current.board.port == "esp32":
            raise TypeError("extra keyword arguments given")

        def edge(level):
            if handler and trigger & (Pin.IRQ_RISING if level else Pin.IRQ_FALLING):
                handler(self)

        current.board.watch_pin(self.id, edge)

    def __call__(self, level=None):
        return self.value(level)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)
