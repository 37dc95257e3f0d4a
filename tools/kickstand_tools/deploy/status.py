"""What the firmware on a board says of itself."""

from ..errors import InputError
from .connection import connected, describe, last_line, refuse_unfit_firmware, restart

_STATUS_S = 60  # an emulated board takes a while to compile the modules


def status(port: str | None) -> str:
    """What kickstand.status() prints on the board, which is restarted then.

    port: None takes the only board that is plugged in.  Raises InputError, NoFirmware.
    """
    with connected(port) as (transport, name):
        describe(transport, name)
        try:
            out, error = transport.exec_raw("import kickstand\nkickstand.status()", timeout=_STATUS_S)
            if error:
                reason = last_line(error.decode(errors="replace"))
                refuse_unfit_firmware(reason, name)
                raise InputError(
                    f"the board cannot tell its status ({reason}): bring it up to date with kickstand flash"
                )
            return out.decode(errors="replace").replace("\r\n", "\n").rstrip()
        finally:
            restart(transport)
