"""The radio, a Bluetooth LE peripheral for one phone at a time, with its packets and the keys of paired phones.

The interrupt records events, and the loop handles them. firmware/docs/live.md describes the bytes of the packets. An
unknown value is never sent as a plausible number. RaceChrono then gets no packet, and our own page gets UNKNOWN.
"""

import json
from binascii import hexlify, unhexlify
from math import floor
from struct import pack_into, unpack_from

from ..errors import Refusal
from ..units import __version__, const

VERSION = 1  # version of Kickstand's own packets
# Kinds of packets, which are also the indices in `intervals`. RaceChrono's packet ids are higher by 1
LEAN, MOTION, SPEED, OWN = range(4)
_FASTEST_MS = const(40)  # packets of the same kind are at least this far apart
UNKNOWN, UNKNOWN_SPEED, UNKNOWN_SIGMA = -0x8000, 0xFFFF, 0xFF

# UUID of our own service. The service's characteristics have 0001 to 0004 in place of the first 0000.
SERVICE = "7b6f0000-3c1e-4d5a-9a55-6b69636b7374"
_ADVERTISE_US = const(150_000)
_WRITES_BYTES = const(64)  # bytes of writes to a characteristic that can wait for the loop

_CONNECTED, _DISCONNECTED, _WRITTEN, _GET_SECRET, _SET_SECRET, _PASSKEY = 1, 2, 3, 29, 30, 31
_READ, _WRITE, _NOTIFY = 0x02, 0x08, 0x10
# Flags that allow a read or write only over an encrypted link, with a phone on which the PIN was entered
_READ_PAIRED, _WRITE_PAIRED = 0x0600, 0x3000
_DISPLAY_ONLY = 0  # tells the phone that the board shows the PIN, so the phone asks its user for it

BONDS = "live_bonds.json"


def whole(value, scale, low=-0x7FFF, high=0x7FFF):
    """Return the value in units of 1 / scale, rounded and limited to the range from low to high."""
    return max(low, min(high, floor(scale * value + 0.5)))


def _sigma(sigma_deg):
    return whole(sigma_deg, 10, 0, 0xFE)


def pack_lean(buffer, lean_deg, sigma_deg):
    """Write RaceChrono's packet 1 into the buffer. Return its length."""
    pack_into("<IhB", buffer, 0, LEAN + 1, whole(lean_deg, 10), _sigma(sigma_deg))
    return 7


def pack_motion(buffer, force, rate_dps, trusted):
    """Write RaceChrono's packet 2 into the buffer. Return its length.

    Args:
        force: force to the left, up and forward, in g.
        rate_dps: rate about left, up and forward, in deg/s.
        trusted: True if the lean can be trusted.
    """
    pack_into("<I", buffer, 0, MOTION + 1)
    forces = whole(force[2], 1000), whole(force[0], 1000), whole(force[1], 1000)
    pack_into("<5hB", buffer, 4, *forces, whole(rate_dps[1], 10), whole(rate_dps[2], 10), trusted)
    return 15


def pack_speed(buffer, speed_mps):
    """Write RaceChrono's packet 3 into the buffer. Return its length."""
    pack_into("<IH", buffer, 0, SPEED + 1, whole(speed_mps, 100, 0, 0xFFFE))
    return 6


def pack_now(buffer, ms, lean_deg, sigma_deg, force, rate_dps, speed_mps, state):
    """Write our own packet with the current values into the buffer. Return its length.

    Args:
        ms: ticks_ms().
        lean_deg, sigma_deg: the lean and its standard deviation; both None if unknown.
        force: force to the left, up and forward, in g, or None.
        rate_dps: rate about left, up and forward, in deg/s. The rate is not sent if force is None.
        speed_mps: the speed, or None.
        state: bits, from bit 0: aligned, trusted, at rest, fallen, recording, car, no readings.
    """
    is_known = lean_deg is not None
    tilt = (whole(lean_deg, 100), _sigma(sigma_deg)) if is_known else (UNKNOWN, UNKNOWN_SIGMA)
    pack_into("<HhB", buffer, 0, ms & 0xFFFF, *tilt)
    for i in range(3):
        pack_into("<h", buffer, 5 + 2 * i, UNKNOWN if force is None else whole(force[i], 2048))
        pack_into("<h", buffer, 11 + 2 * i, UNKNOWN if force is None else whole(rate_dps[i], 16))
    pack_into("<HB", buffer, 17, UNKNOWN_SPEED if speed_mps is None else whole(speed_mps, 100, 0, 0xFFFE), state)
    return 20


def pack_ride(buffer, state, meter, lost):
    """Write our own packet with the values of the ride so far into the buffer. Return its length.

    Args:
        state: as for pack_now().
        meter: a LeanMeter.
        lost: number of lost samples.
    """
    leans = whole(meter.max_left_deg, 10), whole(meter.max_right_deg, 10)
    peaks = whole(meter.max_accel_g, 1000), whole(meter.max_brake_g, 1000)
    pack_into("<BB4HhH", buffer, 0, VERSION, state, *leans, *peaks, whole(meter.trim_deg, 100), min(lost, 0xFFFF))
    return 14


def _interval(data, start, form):
    return max(_FASTEST_MS, unpack_from(form, data, start)[0])


FILTER_LENGTHS = {0: 1, 1: 3, 2: 7}  # first byte of a command to RaceChrono's filter: bytes of the command


def take_filter(data, intervals):
    """Execute a command that RaceChrono has written to its filter.

    Args:
        data: the bytes of the command.
        intervals: list of the milliseconds between two packets of each kind; 0 if no packets are requested. The
            function updates it.

    Returns:
        False if the bytes are not one of RaceChrono's commands.
    """
    command = bytes(data[:1]), len(data)
    if command == (b"\x00", 1):
        intervals[LEAN] = intervals[MOTION] = intervals[SPEED] = 0
    elif command == (b"\x01", 3):
        intervals[LEAN] = intervals[MOTION] = intervals[SPEED] = _interval(data, 1, ">H")
    elif command == (b"\x02", 7):
        packet = unpack_from(">I", data, 3)[0]
        if 0 < packet <= SPEED + 1:
            intervals[packet - 1] = _interval(data, 1, ">H")
    else:
        return False
    return True


def take_rate(data, intervals):
    """Execute a command of our own page. The command has the milliseconds between two packets, or 0 for no packets.

    The arguments are those of take_filter(). Return False if the bytes are not a command."""
    if len(data) != 2:
        return False
    intervals[OWN] = _interval(data, 0, "<H") if data[0] or data[1] else 0
    return True


class Bonds:
    """The keys of paired phones in flash. A paired phone need not enter the PIN again.

    Args:
        pin: the PIN. If this PIN differs from the stored PIN, all phones must pair again.
    """

    def __init__(self, pin):
        self._pin = pin
        self._keys = {}  # maps (type, key) to a value, all in the form of MicroPython's bluetooth
        self._changed = False
        try:
            with open(BONDS) as file:
                saved = json.load(file)
            if saved["pin"] == pin:
                self._keys = {(kind, unhexlify(key)): unhexlify(value) for kind, key, value in saved["keys"]}
        except (OSError, ValueError, KeyError, TypeError):  # without a valid file all phones must pair again
            pass

    def get(self, kind, index, key):
        """Return a stored value, or None if there is no such value.

        Args:
            kind: the type of the key.
            index: if key is None, the index of the value among all values of this type.
            key: the key, or None.
        """
        if key is not None:
            return self._keys.get((kind, bytes(key)))
        values = [value for address, value in self._keys.items() if address[0] == kind]
        return values[index] if index < len(values) else None

    def put(self, kind, key, value):
        """Store a value. The value None deletes the stored value. Return True on success."""
        address = kind, bytes(key)
        if value is None and address not in self._keys:
            return False
        if value is None:
            del self._keys[address]
        else:
            self._keys[address] = bytes(value)
        self._changed = True
        return True

    def save(self):
        """Write the changes to flash. If that fails, the only consequence is that the phones must enter the PIN again.
        Raises nothing."""
        if not self._changed:
            return
        self._changed = False
        keys = [[kind, hexlify(key).decode(), hexlify(value).decode()] for (kind, key), value in self._keys.items()]
        try:
            with open(BONDS, "w") as file:
                json.dump({"pin": self._pin, "keys": keys}, file)
        except OSError:
            pass


class Radio:
    """Sends notifications to one phone, and keeps the phone's writes for the loop. Raises Refusal.

    After an exception in the interrupt MicroPython would never call it again, so the interrupt raises nothing and
    takes no heap except for keys: it sets attributes that exist, and the loop reads what the phone has written.

    Args:
        pin: six digits that must be entered on a phone, or None.

    Attributes:
        phone: the handle of the connected phone, or None.
        changed: True if the phone has connected or disconnected since the loop set it to False.
        written: True if the phone has written to `filter` or `rate` since the loop set it to False.
        filter, rate, chrono, now, ride: the handles of the characteristics.
        name: the advertised name of the board.
    """

    def __init__(self, pin=None):
        try:
            from bluetooth import BLE, UUID
        except ImportError:
            raise Refusal("no-radio")
        self._ble = ble = BLE()
        self._pin = pin
        self._bonds = None
        if pin is not None and not hasattr(ble, "gap_passkey"):
            raise Refusal("no-pairing")
        self.phone, self.changed = None, True
        self.written = False
        try:
            if pin is not None:
                self._bonds = Bonds(pin)
            ble.irq(self._irq)
            if pin is not None:
                ble.config(bond=True, mitm=True, le_secure=True, io=_DISPLAY_ONLY)
            ble.active(True)
            self._register(UUID)
        except MemoryError:
            self.stop()
            raise
        except OSError as error:
            self.stop()
            raise Refusal("radio-fault", str(error))

    def _register(self, uuid):
        ble, paired = self._ble, self._pin is not None
        read, write = _READ | _READ_PAIRED * paired, _WRITE | _WRITE_PAIRED * paired
        flags = read, write, _NOTIFY, read | _NOTIFY
        characteristics = tuple((uuid(SERVICE.replace("0000", "000%d" % (i + 1), 1)), flags[i]) for i in range(4))
        chrono = (uuid(0x0001), read | _NOTIFY), (uuid(0x0002), write)
        handles = ble.gatts_register_services(((uuid(0x1FF8), chrono), (uuid(SERVICE), characteristics)))
        (self.chrono, self.filter), (board, self.rate, self.now, self.ride) = handles
        for handle in self.filter, self.rate:
            ble.gatts_set_buffer(handle, _WRITES_BYTES, True)
        mac = ble.config("mac")[1]
        self.name = "Kickstand %02X%02X" % (mac[4], mac[5])
        ble.config(gap_name=self.name)
        ble.gatts_write(board, bytes([VERSION]) + ("%s, %s" % (self.name, __version__)).encode())
        ours = bytes(reversed(unhexlify(SERVICE.replace("-", ""))))
        self._found = b"\x02\x01\x06\x03\x03\xf8\x1f\x11\x07" + ours
        self._named = bytes([1 + len(self.name), 9]) + self.name.encode()

    def _irq(self, event, data):
        try:
            if event == _WRITTEN:
                self.written = True
            elif event == _CONNECTED or event == _DISCONNECTED:
                self.phone = data[0] if event == _CONNECTED else None
                self.written = False
                self.changed = True
            elif event == _PASSKEY:
                getattr(self._ble, "gap_passkey")(data[0], data[1], self._pin)  # noqa: B009 missing in the stubs of rp2
            elif self._bonds and event == _GET_SECRET:
                return self._bonds.get(*data)
            elif self._bonds and event == _SET_SECRET:
                return self._bonds.put(*data)
        except Exception:  # without memory for a key the phone must enter the PIN again
            pass
        return None

    def take_writes(self, handle):
        """Return the bytes that the phone has written to `filter` or `rate` since the last call, all writes in a row.

        Set `written` to False before. Raises nothing: without memory the writes wait for the next call."""
        try:
            return self._ble.gatts_read(handle)
        except (OSError, MemoryError):
            self.written = True
            return b""

    def advertise(self):
        """Advertise the board to the next phone. Return True on success."""
        return self._attempt(self._ble.gap_advertise, _ADVERTISE_US, self._found, resp_data=self._named)

    def send(self, handle, data):
        """Queue a notification. Return False if the radio has no room for the notification, or the phone has just
        disconnected."""
        return self._attempt(self._ble.gatts_notify, self.phone, handle, data)

    def keep(self, handle, data):
        """Set the value of a characteristic that a phone can read."""
        self._attempt(self._ble.gatts_write, handle, data)

    def drop(self):
        """Disconnect the phone, so that another phone can connect."""
        self._attempt(self._ble.gap_disconnect, self.phone)

    def save_bonds(self):
        """Write the keys that a pairing has changed to flash. Call this method in the loop, because a write takes
        long."""
        if self._bonds:
            self._bonds.save()

    def stop(self):
        """Switch the radio off until the next power-on."""
        self._attempt(self._ble.active, False)

    @staticmethod
    def _attempt(function, *arguments, **named):
        try:
            function(*arguments, **named)
            return True
        except (OSError, MemoryError, TypeError):
            # MemoryError is raised if the port's store for packets that the phone has not yet received is full.
            # TypeError is raised if the phone has just disconnected, because then the handle is None.
            return False
