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
    "live": {"calibration.transform"},  # the radio stands in live.radio, what is sent does not know it
    "ui": {"board.button", "lean", "calibration", "drive_alignment"},
    "settings": {"board", "imu.mpu6050"},  # ranges and pins that can be chosen
    "devices": {"board", "imu"},
    "diagnosis": {"imu"},
    "status_report": {
        "board.display",
        "diagnosis",
        "imu",
        "calibration",
        "speed",
        "ui.messages",
        "console",
        "devices",
        "settings",
    },
    "app": {"board", "imu", "calibration", "lean", "drive_alignment", "speed", "rides", "ui", "devices"},
    "state": set(),
    "user_code": set(),
    "start": {"board", "devices", "settings"},
    "__init__": {"status_report"},
}
# Imported only by a function that needs it, because it costs memory or words that most boards never need
LATE = {
    "errors": {"console"},  # report() prints a refusal in words
    "status_report": {"rides"},  # is its machine code used?
    "app": {"state", "user_code"},
    "devices": {"diagnosis"},  # why no sensor answers
    "start": {"app", "console", "ui.messages", "live"},  # the display says "starting" meanwhile
}
# What only drivers may import: modules of MicroPython that speak to hardware
HARDWARE = {"machine", "micropython", "esp32", "rp2", "neopixel", "network", "bluetooth"}
DRIVERS = {"board", "imu", "speed", "devices", "diagnosis", "start", "live.radio"}


def modules():
    """(folder, path) of each module: its folder, or the module's own name where it is in none."""
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


def allowed(target, folder, late):
    """target: a dotted module below kickstand."""
    if not target or target == folder or target.startswith(folder + ".") or target in ROOT:
        return True
    may = ARROWS[folder] | (LATE.get(folder, set()) if late else set())
    return any(target == place or target.startswith(place + ".") for place in may)


def test_nothing_imports_what_it_may_not():
    wrong = [
        f"{path.name} ({folder}) imports {target}"
        for folder, path in modules()
        for target, late in imports(path)
        if not allowed(target, folder, late)
    ]
    assert wrong == []


def test_a_wrong_arrow_is_noticed(tmp_path):
    """An arrow that points back, within a function too; one that is allowed late only; and what is right."""
    lines = (
        "from ..lean import meter",
        "def f():\n    from .. import app",
        "from ..console import say",
        "from .sensor import x",
    )
    for folder, name in (("imu", "mpu6050"), ("imu", "sensor"), ("lean", "meter")):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / f"{name}.py").touch()
    (tmp_path / "app.py").touch()
    (tmp_path / "imu" / "mpu6050.py").write_text("\n".join(lines))
    found = imports(tmp_path / "imu" / "mpu6050.py", tmp_path)
    assert [target for target, late in found if not allowed(target, "imu", late)] == ["lean.meter", "console", "app"]
    assert allowed("console", "errors", True) and not allowed("console", "errors", False)


def test_each_folder_has_its_arrows():
    assert {folder for folder, _ in modules()} == set(ARROWS)


def test_no_arrow_is_left_over():
    """Each that is allowed is there."""
    used = {}
    for folder, path in modules():
        for target, _ in imports(path):
            used.setdefault(folder, set()).add(target)
    for folder, targets in ARROWS.items():
        for target in targets | LATE.get(folder, set()):
            there = any(name == target or name.startswith(target + ".") for name in used.get(folder, ()))
            assert there, f"{folder} no longer imports {target}"


def test_no_module_imports_itself_by_way_of_others():
    """Not even within functions."""
    package = firmware_path.PACKAGE
    found = {".".join(path.relative_to(package).with_suffix("").parts): imports(path) for _, path in modules()}
    graph = TopologicalSorter({name: {target or "__init__" for target, _ in seen} for name, seen in found.items()})
    graph.prepare()  # raises CycleError


def test_joining_knows_no_analysis():
    """Of the tools: both are results of the same rooms."""
    tools = firmware_path.TOOLS / "kickstand_tools"
    for path in sorted((tools / "joining").rglob("*.py")):
        for target, _ in imports(path, tools):
            assert target.partition(".")[0] != "analysis", f"{path.name} imports {target}"


def test_mathematics_knows_no_hardware():
    for folder, path in modules():
        if not {folder, f"{folder}.{path.stem}"} & DRIVERS and not path.stem.endswith("_viper"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module] if isinstance(node, ast.ImportFrom) and not node.level and node.module else []
                assert not HARDWARE & set(names), f"{path.name} imports {names}"
