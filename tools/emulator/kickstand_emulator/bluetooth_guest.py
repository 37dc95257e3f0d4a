"""Replaces the module bluetooth on the emulated board, and discards all data.

A phone is always connected. The phone subscribes to everything at the highest rate.
"""

FASTEST_MS = 40


def UUID(value):
    return value


class BLE:
    """The part of bluetooth.BLE that live/radio.py uses."""

    def __init__(self):
        self.sent = 0
        self._values = {}

    def irq(self, handler):
        self._handler = handler

    def active(self, on):
        pass

    def config(self, *asked, gap_name=None):
        return 0, b"\x00\x00\x00\x00\x1a\x2b"

    def gatts_register_services(self, services):
        return (8, 11), (14, 17, 20, 23)

    def gatts_write(self, handle, data):
        pass

    def gatts_set_buffer(self, handle, length, append):
        pass

    def gatts_read(self, handle):
        return self._values.pop(handle, b"")

    def gatts_notify(self, phone, handle, data):
        self.sent += 1

    def connect(self):
        self._handler(1, (0, 0, b"phone."))
        for handle, data in ((11, b"\x01" + FASTEST_MS.to_bytes(2, "big")), (17, FASTEST_MS.to_bytes(2, "little"))):
            self._values[handle] = data
            self._handler(3, (0, handle))
