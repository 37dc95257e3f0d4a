"""Stores the keys of paired phones in flash. A paired phone need not enter the PIN again."""

import json
from binascii import hexlify, unhexlify

PATH = "live_bonds.json"


class Bonds:
    """The stored keys.

    Args:
        pin: the PIN. If this PIN differs from the stored PIN, all phones must pair again.
    """

    def __init__(self, pin):
        self._pin = pin
        self._keys = {}  # maps (type, key) to a value, all in the form of MicroPython's bluetooth
        self._changed = False
        try:
            with open(PATH) as file:
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
            with open(PATH, "w") as file:
                json.dump({"pin": self._pin, "keys": keys}, file)
        except OSError:
            pass
