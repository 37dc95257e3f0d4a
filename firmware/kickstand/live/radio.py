"""The radio, a Bluetooth LE peripheral for one phone at a time. The interrupt records events, and the loop handles
them."""

from binascii import unhexlify

from ..errors import LiveError
from ..units import __version__, const
from . import packets

# UUID of our own service. The service's characteristics have 0001 to 0004 in place of the first 0000.
SERVICE = "7b6f0000-3c1e-4d5a-9a55-6b69636b7374"
_ADVERTISE_US = const(150_000)
_WRITES_BYTES = const(64)  # bytes of writes to a characteristic that can wait for the loop

_CONNECTED, _DISCONNECTED, _WRITTEN, _GET_SECRET, _SET_SECRET, _PASSKEY = 1, 2, 3, 29, 30, 31
_READ, _WRITE, _NOTIFY = 0x02, 0x08, 0x10
# Flags that allow a read or write only over an encrypted link, with a phone on which the PIN was entered
_READ_PAIRED, _WRITE_PAIRED = 0x0600, 0x3000
_DISPLAY_ONLY = 0  # tells the phone that the board shows the PIN, so the phone asks its user for it


class Radio:
    """Sends notifications to one phone, and keeps the phone's writes for the loop. Raises LiveError.

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
            raise LiveError("no-radio")
        self._ble = ble = BLE()
        self._pin = pin
        self._bonds = None
        if pin is not None and not hasattr(ble, "gap_passkey"):
            raise LiveError("no-pairing")
        self.phone, self.changed = None, True
        self.written = False
        try:
            if pin is not None:
                from .bonds import Bonds

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
            raise LiveError("radio-fault", str(error))

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
        ble.gatts_write(board, bytes([packets.VERSION]) + ("%s, %s" % (self.name, __version__)).encode())
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
