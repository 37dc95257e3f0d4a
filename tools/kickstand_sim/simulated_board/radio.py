"""Models the board's Bluetooth LE radio and its connection to one phone, in plain Python, on the board's clock.

A phone is any object with the methods heard(handle, data) and dropped(). A phone calls connect(), disconnect(),
write(), read() and give_pin() of the radio.
"""

import sys

from .clock import to_us

if sys.implementation.name == "micropython":
    from micropython import heap_lock, heap_unlock  # type: ignore[import-not-found]
else:  # CPython cannot lock its heap
    heap_lock = heap_unlock = int

EVENT_S = 0.03  # time between two connection events, at which waiting notifications are sent
ROOM = 12  # number of notifications that NimBLE keeps on an ESP32; btstack on a Pico W has no limit

CONNECTED, DISCONNECTED, WRITTEN, GET_SECRET, SET_SECRET, PASSKEY = 1, 2, 3, 29, 30, 31
READ, WRITE, NOTIFY = 0x02, 0x08, 0x10
READ_PAIRED, WRITE_PAIRED = 0x0600, 0x3000
_DISPLAY = 3
_BOND = 2  # the type of the secret that pairing stores


class Radio:
    """The radio of a board.

    pairs: True if its MicroPython can ask for a PIN, as on an ESP32. Then it keeps at most ROOM notifications.
    found, named: the advertised data, or None.
    services: [(uuid, [(uuid, flags, handle), ...]), ...].
    values: {handle: bytes}.
    phone: the connected phone, or None.
    away: True while the phone is out of reach.
    fails: True if active(True) raises OSError.
    connections: number of connections since the radio exists.
    """

    def __init__(self, clock, pairs=False, address=b"\x28\xcd\xc1\x0a\x1a\x2b"):
        self._clock = clock
        self.pairs = pairs
        self.address = address
        self.fails = False
        self.connections = 0
        self.off()

    def off(self):
        self.irq = None
        self.active = False
        self.config = {}
        self.found = self.named = self.phone = None
        self.services, self.values, self.flags = [], {}, {}
        self.buffers = {}  # {handle: (length, True if writes are appended)}
        self._waiting = []
        self._passkey = None
        self.paired = self.away = False

    # Called by the fake `bluetooth`

    def register(self, services):
        """Assign a handle to each characteristic. Returns the handles of each service."""
        handle = 8
        self.services = []
        for uuid, characteristics in services:
            made = []
            for kind, flags in characteristics:
                handle += 3
                made.append((kind.value, flags, handle))
                self.values[handle], self.flags[handle] = b"", flags
            self.services.append((uuid.value, made))
        return [[handle for _, _, handle in made] for _, made in self.services]

    def notify(self, handle, data):
        """Queue a notification for the next connection event. Returns False if there is no room."""
        if self.pairs and len(self._waiting) >= ROOM:
            return False
        self._waiting.append((handle, data))
        return True

    def take_passkey(self, passkey):
        self._passkey = passkey

    def drop(self):
        phone = self.phone
        self.disconnect()
        if phone is not None:
            phone.dropped()

    def _plan_connection_event(self, connection):
        """Let the next connection event come after EVENT_S, and further ones until the connection ends.

        connection: the number of the connection, the value of `connections` while it lasts.
        """

        def event():
            if connection != self.connections or self.phone is None:
                return
            self._plan_connection_event(connection)
            if not self.away:
                self._send()

        self._clock.at(self._clock.now_us + to_us(EVENT_S), event)

    def _send(self):
        phone, waiting = self.phone, self._waiting
        self._waiting = []
        for handle, data in waiting:
            if phone is not None:
                phone.heard(handle, data)

    def _tell(self, event, *data):
        """Call the firmware's handler. Returns its result.

        The heap may be full at any time, so the handler gets no heap except for keys. After an exception MicroPython
        never calls the handler again (extmod/modbluetooth.c).
        """
        if not self.irq:
            return None
        needs_heap = event in (GET_SECRET, SET_SECRET)
        try:
            if not needs_heap:
                heap_lock()
            return self.irq(event, data)
        except Exception:
            self.irq = None
            return None
        finally:
            if not needs_heap:
                heap_unlock()

    # Called by a phone

    def connect(self, phone, address=b"\x01\x02\x03\x04\x05\x06"):
        """Connect a phone. Returns False if the board does not advertise. The board knows a paired phone by address."""
        if self.found is None or self.phone is not None:
            return False
        self.found = self.named = None
        self.phone, self.peer = phone, address
        self.connections += 1
        bonded = self.config.get("bond") and self._tell(GET_SECRET, _BOND, 0, address)
        self.paired = bool(bonded)
        self._plan_connection_event(self.connections)
        self._tell(CONNECTED, 0, 0, address)
        return True

    def disconnect(self):
        """End the connection from the phone's side, or because the phone is gone."""
        self.phone = None
        self._waiting = []
        self.paired = self.away = False
        self._tell(DISCONNECTED, 0, 0, self.peer)

    def give_pin(self, pin):
        """Pair with the PIN that the rider typed into the phone. Returns True if it was right."""
        if not self.config.get("mitm"):
            return False
        if pin == self.ask_pin():
            self.pair()
        return self.paired

    def ask_pin(self):
        self._tell(PASSKEY, 0, _DISPLAY, 0)
        return self._passkey

    def pair(self):
        self.paired = True
        self._tell(SET_SECRET, _BOND, self.peer, b"\x00key")

    def write(self, handle, data):
        """Write a value. Returns False if writing is not allowed, or allowed only after pairing."""
        flags = self.flags[handle]
        if not flags & WRITE or (flags & WRITE_PAIRED and not self.paired):
            return False
        length, append = self.buffers.get(handle, (20, False))  # MicroPython stores at most 20 bytes without a buffer
        self.values[handle] = ((self.values[handle] if append else b"") + bytes(data[:20]))[:length]
        self._tell(WRITTEN, 0, handle)
        return True

    def read(self, handle):
        """Return a value, or None if reading is not allowed, or allowed only after pairing."""
        flags = self.flags[handle]
        return self.values[handle] if flags & READ and (self.paired or not flags & READ_PAIRED) else None
