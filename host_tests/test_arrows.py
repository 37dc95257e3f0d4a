"""Who may import whom in the firmware: the architecture, written once and held.

A sample goes one way, imu -> calibration -> lean -> ui. drive_alignment, speed and rides stand beside that way. The app
wires them all, and nothing but start, which main.py runs, imports the app.
"""

import ast
from graphlib import TopologicalSorter

from kickstand_tools import firmware_path

ROOT = {"errors", "units", "rotation"}  # modules above the folders that any folder may import

# folder or module: what else of the firmware it may import
ARROWS = {
    "errors": set(),
    "units": set(),
    "rotation": set(),
    "console": set(),
    "board": set(),  # pins, bus, button, display, card: no mathematics
    "imu": set(),
    "calibration": set(),
    "lean": {"calibration"},
    "drive_alignment": set(),  # it works on the calibrations that the app hands to it
    "speed": {"board"},
    "rides": {"board", "calibration", "console"},  # each block of a ride holds its calibration's record
    "ui": {"board.button", "lean", "calibration", "drive_alignment"},
    "settings": {"board", "imu.mpu6050"},  # ranges and pins that can be chosen
    "devices": {"board", "imu"},
    "status_report": {"imu", "calibration", "speed", "ui.messages", "console", "devices", "settings"},
    "app": {"board", "imu", "calibration", "lean", "drive_alignment", "speed", "rides", "ui", "devices"},
    "start": {"board", "devices", "settings"},
    "__init__": {"status_report"},
}
# Imported only by a function that needs it, because it costs memory or words that most boards never need
LATE = {
    "errors": {"console"},  # report() prints a refusal in words
    "status_report": {"rides"},  # is its machine code used?
    "start": {"app", "console", "ui.messages"},  # the display says "starting" while the app is imported
}
# What only drivers may import: modules of MicroPython that speak to hardware
HARDWARE = {"machine", "micropython", "esp32", "rp2", "neopixel", "network", "bluetooth"}
DRIVERS = {"board", "imu", "speed", "devices", "start"}


def modules():
    """(room, path) of each module: the folder, or the module's own name where it is in none."""
    package = firmware_path.PACKAGE
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package)
        yield (place.parts[0] if len(place.parts) > 1 else place.stem), path


def imports(path, package=None):
    """(module below kickstand, is it imported within a function) of each import of the firmware's own."""
    package = package or firmware_path.PACKAGE
    folders = path.relative_to(package).parts[:-1]
    tree = ast.parse(path.read_text(encoding="utf-8"))
    early = {id(node) for node in tree.body} | {
        id(inner) for node in tree.body if isinstance(node, ast.Try) for inner in node.body
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            parts = list(folders[: len(folders) - node.level + 1])
            parts += node.module.split(".") if node.module else []
            for alias in node.names:
                whole = ".".join([*parts, alias.name])
                is_module = (package / whole.replace(".", "/")).with_suffix(".py").exists()
                yield (whole if is_module else ".".join(parts)), id(node) not in early


def allowed(target, room, late):
    """target: a dotted module below kickstand."""
    if not target or target == room or target.startswith(room + ".") or target in ROOT:
        return True
    may = ARROWS[room] | (LATE.get(room, set()) if late else set())
    return any(target == place or target.startswith(place + ".") for place in may)


def wrong_arrows(found):
    return [
        f"{path.name} ({room}) imports {target}"
        for room, path in found
        for target, late in imports(path)
        if not allowed(target, room, late)
    ]


def test_nothing_imports_what_it_may_not():
    assert wrong_arrows(modules()) == []


def test_a_wrong_arrow_is_noticed(tmp_path, monkeypatch):
    """One import too many, of each kind that matters."""
    for room, module, line in (
        ("lean", "meter", "from ..imu import sensor"),
        ("imu", "sensor", "from ..lean.meter import LeanMeter"),
        ("board", "hd44780", "from ..ui import pages"),
        ("rides", "usb_stream", "from .. import app"),
        ("calibration", "store", "from ..lean import meter"),
    ):
        folder = tmp_path / "kickstand" / room
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{module}.py").write_text(line + "\n")
    for folder in ("imu", "lean", "ui"):
        (tmp_path / "kickstand" / folder).mkdir(parents=True, exist_ok=True)
        for name in ("sensor", "meter", "pages"):
            (tmp_path / "kickstand" / folder / f"{name}.py").touch()
    (tmp_path / "kickstand" / "lean" / "meter.py").write_text("from ..imu import sensor\n")
    (tmp_path / "kickstand" / "imu" / "sensor.py").write_text("from ..lean.meter import LeanMeter\n")
    (tmp_path / "kickstand" / "app.py").touch()
    monkeypatch.setattr(firmware_path, "PACKAGE", tmp_path / "kickstand")
    assert len(wrong_arrows(modules())) == 5


def test_each_folder_has_its_arrows():
    assert {room for room, _ in modules()} == set(ARROWS)


def test_no_arrow_is_left_over():
    """Each that is allowed is there."""
    used = {}
    for room, path in modules():
        for target, _ in imports(path):
            used.setdefault(room, set()).add(target)
    for room, targets in ARROWS.items():
        for target in targets | LATE.get(room, set()):
            there = any(name == target or name.startswith(target + ".") for name in used.get(room, ()))
            assert there, f"{room} no longer imports {target}"


def test_no_module_imports_itself_by_way_of_others():
    """Not even within functions."""
    package = firmware_path.PACKAGE
    found = {".".join(path.relative_to(package).with_suffix("").parts): imports(path) for _, path in modules()}
    graph = TopologicalSorter({name: {target or "__init__" for target, _ in seen} for name, seen in found.items()})
    graph.prepare()  # raises CycleError


def test_mathematics_knows_no_hardware():
    for room, path in modules():
        if room not in DRIVERS and not path.stem.endswith("_viper"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module] if isinstance(node, ast.ImportFrom) and not node.level and node.module else []
                assert not HARDWARE & set(names), f"{path.name} imports {names}"
