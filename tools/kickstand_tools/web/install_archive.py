"""What install_guest.py and cable_guest.py need to talk to a board: the tools that `kickstand flash`, `record` and
`pull` consist of, mpremote, and the firmware, as sources and compiled for every machine code of a board.
"""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mpremote

from .. import firmware_path
from ..deploy import bytecode
from ..deploy.firmware_files import firmware_files
from .zipped import tools, zipped

# Of Pico; of Pico 2; of ESP32-C3, C6 and H2 and of a Pico 2's other processor; of all other ESP32
ARCHITECTURES = ("armv6m", "armv7emsp", "rv32imc", "xtensawin")
# In place of pyserial, and of a module for terminals: what mpremote asks of them as it is imported
_STANDS_IN = {
    "serial/__init__.py": b"SerialException = OSError\n",
    "serial/tools/__init__.py": b"",
    "serial/tools/list_ports.py": b"",
    "mpremote/console.py": b"VT_ENABLED = False\n",
}
_MPREMOTE = ("__init__.py", "mp_errno.py", "transport.py", "transport_serial.py")


def archive() -> bytes:
    """The archive, a ZIP file: tools/ and firmware/ as in a checkout, mpremote/, serial/, compiled/."""
    files = {f"mpremote/{name}": Path(mpremote.__file__).parent / name for name in _MPREMOTE}
    files |= {f"tools/{name}": path for name, path in tools("web/cable_guest.py", "web/install_guest.py").items()}
    files |= {f"firmware{path}": source for path, source in firmware_files().items()}
    return zipped({name: path.read_bytes() for name, path in files.items()} | _STANDS_IN | _compiled())


def firmware() -> bytes:
    """The firmware as a ZIP file, for a browser that cannot connect to a board: its rider takes mpremote."""
    return zipped({f"kickstand-firmware{path}": source.read_bytes() for path, source in firmware_files().items()})


def _compiled() -> dict[str, bytes]:
    """compiled/ARCHITECTURE/... .mpy: of all but the first only what contains machine code. Nothing where there is no
    compiler: then the sources are copied."""
    sources = sorted(firmware_path.PACKAGE.rglob("*.py"))
    first, *others = ARCHITECTURES
    try:
        with ThreadPoolExecutor() as pool:
            made = dict(zip(sources, pool.map(lambda source: bytecode.cross_compiled(source, first), sources)))
            found = {(first, source): data for source, data in made.items()}
            for source in [source for source, data in made.items() if data[2]]:
                found |= {(other, source): bytecode.cross_compiled(source, other) for other in others}
    except bytecode.CannotCompile:
        return {}
    package = firmware_path.PACKAGE
    return {
        f"compiled/{architecture}/{source.relative_to(package).with_suffix('.mpy').as_posix()}": data
        for (architecture, source), data in found.items()
    }
