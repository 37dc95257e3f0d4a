"""The simulated board that the fakes of `machine` act on: the one that was installed last. And its soft interrupts."""

CALL_US = 2  # what a call into `machine` takes, so that a loop that waits for a pin comes to an end
IRQ_US = 26  # that an interrupt takes beside its calls into `machine` and `time`: 33 in all, as on a Pico


def use(installed):
    """From now on `machine` acts on this simulator.Board."""
    global board, soft_irqs
    board = installed
    soft_irqs = SoftIrqs(board.clock)


class SoftIrqs:
    """Interrupts of an ESP32: MicroPython calls their handlers between two steps of the program. During a transfer of
    SoftI2C, which is one step, they wait in the queue of its scheduler, and what does not fit into that is lost.

    clock: a Clock.  held: True during a transfer.
    """

    DEPTH = 8

    def __init__(self, clock):
        self.held = False
        self._clock = clock
        self._queue = []
        self._running = False

    def add(self, handler, pin):
        """An edge has come."""
        if len(self._queue) < self.DEPTH:
            self._queue.append((handler, pin))
        self._run()

    def release(self):
        """A transfer is over."""
        self.held = False
        self._clock.at(self._clock.now_us, self._run)

    def _run(self):
        while self._queue and not self.held and not self._running:
            handler, pin = self._queue.pop(0)
            self._running = True
            try:
                handler(pin)
                self._clock.advance(IRQ_US)
            finally:
                self._running = False
