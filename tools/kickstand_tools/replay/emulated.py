"""replay_engine.py's loop on the emulated Pico: 32-bit floats and the board's own interpreter."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..deploy.bytecode import cross_compiled
from ..emulator import flash_image
from ..emulator.host_link import GUEST, HostLink
from ..emulator.pico import Pico
from . import replay_engine

_CODE = GUEST + "import replay_engine\nreplay_engine.run(Source(), Sink())\n"
_LIMIT_S = 1e6  # of emulated time: a log is as long as it is


def run(records: bytes, sink: Callable[[bytes], Any]) -> None:
    """Replay records (see replay_engine), calling sink with each result. Raises InputError, GuestError."""
    files = flash_image.firmware(compiled=True)
    del files["/main.py"]
    files["replay_engine.mpy"] = cross_compiled(Path(replay_engine.__file__))
    with Pico(files=files) as pico:
        HostLink(pico.chip, records, sink)
        pico.exec(_CODE, _LIMIT_S)
