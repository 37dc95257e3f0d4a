"""A phone beside the simulated board, without a radio stack. The phone follows a plan and keeps what it receives. Runs
on CPython and MicroPython."""

CHRONO, FILTER = (0x1FF8, 0x0001), (0x1FF8, 0x0002)
_OWN = "7b6f000%d-3c1e-4d5a-9a55-6b69636b7374"
BOARD, RATE, NOW, RIDE = ((_OWN % 0, _OWN % number) for number in (1, 2, 3, 4))
PLACES = {"chrono": CHRONO, "filter": FILTER, "board": BOARD, "rate": RATE, "now": NOW, "ride": RIDE}


class Phone:
    """A phone that follows its plan. acts: [[at_s, method, arguments...], ...], with bytes as lists of numbers."""

    def __init__(self, board, acts=()):
        self._board = board
        self.packets = []  # one [s, name of the characteristic, bytes] per received packet
        self.said = []  # one [s, what happened, answer] per event
        for at_s, name, *more in acts:
            board.at(at_s, lambda name=name, more=more: self._do(name, more))

    def _do(self, name, more):
        self.said.append([self._now(), name, getattr(self, name)(*more)])

    def _now(self):
        return self._board.clock.now_us / 1e6

    def record(self):
        return {"packets": self.packets, "said": self.said}

    def handle(self, name):
        """Return the handle of a characteristic in the services that the board has registered."""
        service, kind = PLACES[name]
        for uuid, characteristics in self._board.radio.services:
            for uuid_of, _, handle in characteristics:
                if (uuid, uuid_of) == (service, kind):
                    return handle
        return None

    def connect(self, address=1):
        return self._board.radio.connect(self, bytes([address] * 6))

    def leave(self):
        self._board.radio.disconnect()

    def away(self, is_away):
        self._board.radio.away = is_away

    def write(self, name, data):
        return self._board.radio.write(self.handle(name), bytes(data))

    def read(self, name):
        data = self._board.radio.read(self.handle(name))
        return None if data is None else list(data)

    def give_pin(self, pin):
        return self._board.radio.give_pin(pin)

    # Called by the radio

    def heard(self, handle, data):
        for name in PLACES:
            if self.handle(name) == handle:
                self.packets.append([self._now(), name, list(data)])

    def dropped(self):
        self.said.append([self._now(), "dropped", None])
