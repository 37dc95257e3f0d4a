"""The engine rp2040 of `kickstand replay`, which the entry point in pyproject.toml adds."""

import contextlib
import io
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from kickstand_tools.deploy import firmware_files
from kickstand_tools.logs.source import Progress
from kickstand_tools.replay import replay_engine

_CHUNK = 500  # number of samples between two calls of progress
_RESULT_BYTES = struct.calcsize(replay_engine.RESULT)
_EMULATED_S = 1e6  # limit of the emulated time in s, longer than the replay of any log


@contextlib.contextmanager
def rp2040(records: Iterator[bytes], progress: Progress | None) -> Iterator[IO[bytes]]:
    """Replay on an emulated Pico, with 32-bit floats and the board's own interpreter.

    Yields a file with the results. Raises InputError if the image is missing, and GuestError if the replay fails
    on the Pico.

    records: The records of replay_engine.py.
    progress: Function that is called with the number of finished samples and the number of all.
    """
    from . import image, native

    image.find()
    native.build()
    from .pico import GUEST, HostLink, Pico

    content = b"".join(records)
    results, total = io.BytesIO(), len(content) // struct.calcsize(replay_engine.RECORD)

    def sink(result: bytes) -> None:
        results.write(result)
        if progress and results.tell() % (_CHUNK * _RESULT_BYTES) == 0:
            progress(results.tell() // _RESULT_BYTES, total)

    files = firmware_files.contents(firmware_files.PICO)
    del files["/main.py"]
    files["replay_engine.mpy"] = firmware_files.cross_compiled(Path(replay_engine.__file__))
    with Pico(files=files) as pico:
        HostLink(pico.chip, content, sink)
        pico.exec(GUEST + "import replay_engine\nreplay_engine.run(Source(), Sink())\n", _EMULATED_S)
    results.seek(0)
    yield results
