"""The keys of phones that have given the PIN, kept in flash: such a phone is not asked again."""

import json
from binascii import hexlify, unhexlify

PATH = "live_bonds.json"


class Bonds:
    """pin: with another one than before, all phones are asked again."""

    def __init__(self, pin):
        self._pin = pin
        self._keys = {}  # {(type, key): value}, as MicroPython's bluetooth hands them over
        self._changed = False
        try:
            with open(PATH) as file:
                kept = json.load(file)
            if kept["pin"] == pin:
                self._keys = {(kind, unhexlify(key)): unhexlify(value) for kind, key, value in kept["keys"]}
        except (OSError, ValueError, KeyError, TypeError):  # none yet, or a file that is damaged: they pair again
            pass

    def get(self, kind, index, key):
        """The value for this key, or, without a key, the one at this index of its kind; None if there is none."""
        if key is not None:
            return self._keys.get((kind, bytes(key)))
        found = [value for place, value in self._keys.items() if place[0] == kind]
        return found[index] if index < len(found) else None

    def put(self, kind, key, value):
        """Keep a value, or forget the one before if it is None. True: done."""
        place = kind, bytes(key)
        if value is None and place not in self._keys:
            return False
        if value is None:
            del self._keys[place]
        else:
            self._keys[place] = bytes(value)
        self._changed = True
        return True

    def save(self):
        """Write what has changed. A flash that cannot be written costs no more than giving the PIN again."""
        if not self._changed:
            return
        self._changed = False
        keys = [[kind, hexlify(key).decode(), hexlify(value).decode()] for (kind, key), value in self._keys.items()]
        try:
            with open(PATH, "w") as file:
                json.dump({"pin": self._pin, "keys": keys}, file)
        except OSError:
            pass
