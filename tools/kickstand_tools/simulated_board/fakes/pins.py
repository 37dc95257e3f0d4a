"""MicroPython's machine.Pin on the simulated board."""

from ..clock import Reset
from . import chips, current


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
        machine = current.board.machine
        if self.id in chips.flash_pins(machine):
            raise Reset  # a crash: the next instruction cannot be read
        if self.id in chips.inputs_only(machine):
            if mode in (Pin.OUT, Pin.OPEN_DRAIN):
                raise ValueError("pin can only be input")
            pull = -1
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

        if current.board.port == "esp32":
            self._handler = handler
            current.board.watch_pin(self.id, (lambda level: self._schedule(level, trigger)) if handler else None)
            return

        running, waiting = False, False  # as on the chip one more edge is kept while the handler runs, and no others

        def edge(level):
            nonlocal running, waiting
            if not trigger & (Pin.IRQ_RISING if level else Pin.IRQ_FALLING):
                return
            waiting = True
            if running:
                return
            running = True
            try:
                while waiting and handler and self._handler is handler:
                    waiting = False
                    handler(self)
                    current.board.clock.advance(current.IRQ_US)
            finally:
                running = False

        self._handler = handler
        current.board.watch_pin(self.id, edge if handler else None)

    def _schedule(self, level, trigger):
        if trigger & (Pin.IRQ_RISING if level else Pin.IRQ_FALLING):
            current.soft_irqs.add(self._handler, self)

    def __call__(self, level=None):
        return self.value(level)

    def on(self):
        self.value(1)

    def off(self):
        self.value(0)
