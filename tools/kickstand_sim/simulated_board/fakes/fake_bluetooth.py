"""MicroPython's `bluetooth` for a peripheral, on the radio of the board that was installed last.

Errors are the same as in the ports with NimBLE (ESP32) and btstack (Pico W).
"""

import errno

from . import fake_machine

NOTIFY_US = 150  # processor time of a notification: an assumption, not measured


class UUID:
    """bluetooth.UUID, from a number or a text."""

    def __init__(self, value):
        self.value = value


def BLE():
    """bluetooth.BLE(). On boards that cannot pair, the result has no gap_passkey()."""
    radio = fake_machine.board.radio
    return PairingBle(radio) if radio.pairs else Ble(radio)


class Ble:
    """The firmware's interface to the radio."""

    _PAIRING = ()

    def __init__(self, radio):
        self._radio = radio

    def _on(self):
        if not self._radio.active:
            raise OSError(errno.ENODEV)
        return self._radio

    def active(self, on=None):
        if on and self._radio.fails:
            raise OSError(errno.ETIMEDOUT)
        if on is not None:
            if not on:
                if self._radio.phone is not None:
                    self._radio.drop()
                self._radio.off()
            self._radio.active = bool(on)
        return self._radio.active

    def irq(self, handler):
        self._radio.irq = handler

    def config(self, *asked, **settings):
        if asked == ("mac",):
            return 0, self._on().address
        for name in settings:
            if name not in ("gap_name",) + self._PAIRING:
                raise ValueError("unknown config param")
        self._radio.config.update(settings)
        return None

    def gap_advertise(self, interval_us, adv_data=b"", *, resp_data=b"", connectable=True):
        assert len(adv_data) <= 31 and len(resp_data) <= 31
        if self._on().phone is not None:
            raise OSError(errno.ENOMEM)  # btstack allows only one connection
        self._radio.found, self._radio.named = adv_data, resp_data

    def gap_disconnect(self, conn_handle):
        if self._on().phone is None:
            return False
        self._radio.drop()
        return True

    def gatts_register_services(self, services):
        return self._on().register(services)

    def gatts_set_buffer(self, handle, length, append=False):
        self._on().buffers[handle] = length, append

    def gatts_read(self, handle):
        data = self._on().values[handle]
        if self._radio.buffers.get(handle, (20, False))[1]:
            self._radio.values[handle] = b""
        return data

    def gatts_write(self, handle, data, send_update=False):
        self._on().values[handle] = bytes(data)

    def gatts_notify(self, conn_handle, handle, data=b""):
        if conn_handle is None:
            raise TypeError("can't convert NoneType to int")
        fake_machine.board.clock.advance(NOTIFY_US)
        if self._on().phone is None:
            raise OSError(errno.ENOTCONN)
        if not self._radio.notify(handle, bytes(data)):
            raise OSError(errno.ENOMEM)


class PairingBle(Ble):
    """Adds gap_passkey(), which NimBLE has, but not btstack's build for a Pico W."""

    _PAIRING = ("bond", "mitm", "io", "le_secure")

    def gap_passkey(self, conn_handle, action, passkey):
        self._on().take_passkey(passkey)
