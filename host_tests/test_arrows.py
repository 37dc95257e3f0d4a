"""Checks which modules may import which, in the firmware and in the tools. A sample takes the path imu -> calibration
-> lean -> ui. The folders drive_alignment, speed and rides are beside this path. The app connects all folders. Only
start, which main.py runs, imports the app.

In the tools, kickstand_fleet, kickstand_emulator and the workshop are leaves: they import the core, kickstand_tools.
The core imports none of them, and finds their commands by entry points. Only these commands import cli, for shared
options.
"""

import ast
import functools
from graphlib import TopologicalSorter

from kickstand_tools.common import firmware_path

ROOT = {"errors", "units", "rotation"}  # modules outside the folders, which any folder may import

# {folder or module: the other parts of the firmware that it may import}
ARROWS = {
    "errors": set(),
    "units": set(),
    "rotation": set(),
    "console": set(),
    "board": set(),  # pins, bus, button, display and card, without mathematics
    "imu": set(),
    "calibration": set(),
    "lean": {"calibration"},
    "drive_alignment": set(),  # nothing: the app passes the calibrations to it
    "speed": {"board"},
    "rides": {"board", "calibration", "console"},  # each block of a ride contains the record of its calibration
    "live": {"calibration.transform"},  # only live.radio uses the radio; the modules that build packets do not
    "ui": {"board.button", "lean", "calibration", "drive_alignment"},
    "settings": set(),
    "setting_table": {"board", "imu.mpu6050"},  # for the ranges and pins that can be set
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
    "safe_mode": set(),
    "start": {"board", "devices", "settings"},
    "__init__": {"status_report"},
}
# {part: the parts that it imports only in the function that needs them}. These parts cost memory, and most boards never
# need them.
LATE = {
    "settings": {"setting_table"},  # removed from memory after use
    "errors": {"console"},  # console has the words that report() prints
    "status_report": {"rides"},  # reports whether the machine code of rides is used
    "app": {"state", "user_code"},
    "devices": {"diagnosis"},  # diagnosis finds out why no sensor answers
    "start": {"app", "console", "ui.messages", "live", "safe_mode"},  # loaded while the display says "starting"
}
# MicroPython's hardware modules, which only drivers may import
HARDWARE = {"machine", "micropython", "esp32", "rp2", "neopixel", "network", "bluetooth"}
DRIVERS = {"board", "imu", "speed", "devices", "diagnosis", "start", "live.radio"}

LEAVES = {"kickstand_fleet", "kickstand_emulator", "kickstand_workshop"}
# {part of the tools: the other parts that it may import}. A part is a folder or module of kickstand_tools, or another
# package.
TOOL_ARROWS = {
    "common": set(),
    "signals": set(),  # uses numpy only, no logs and no files
    "logs": {"common", "signals", "checks", "calibration.file"},  # a log is checked while it is read
    "checks": {"common", "signals", "logs.cells", "logs.log", "calibration.file"},
    "calibration": {"common", "signals", "logs", "checks.units"},
    "estimation": {"common", "signals", "logs", "checks", "calibration.file"},
    "replay": {"common", "signals", "logs", "calibration.file"},
    "imports": {"common", "signals", "logs", "checks", "estimation.first_guess"},
    "joining": {"common", "signals", "logs", "calibration.file", "estimation", "replay"},
    "analysis": {
        "common",
        "signals",
        "logs",
        "checks",
        "calibration.file",
        "estimation",
        "replay.meter_along",
    },
    "overlay": {"common", "signals", "logs", "calibration.file", "joining.motion", "analysis"},
    "simulated_board": set(),
    "simulation": {"common", "logs.cells"},
    "demo": {"common", "simulated_board", "simulation.scripted"},
    "deploy": {"common", "simulated_board"},  # tries config.py on the simulated board
    "rides": {"common", "logs", "calibration.file", "deploy", "replay.replay_engine"},
    "pictures": {"common", "simulated_board"},
    "web": {
        "common",
        "logs",
        "calibration",
        "estimation",
        "imports",
        "joining",
        "analysis",
        "simulated_board",
        "simulation",
        "demo.hand_bike",
        "deploy",
        "rides",
        "pictures",
    },
    "api": {
        "common",
        "logs",
        "calibration",
        "estimation",
        "replay",
        "imports",
        "joining",
        "analysis",
        "overlay",
        "simulation",
        "web.site",
    },
    "cli": {
        "common",
        "logs",
        "checks",
        "calibration",
        "estimation",
        "replay",
        "imports",
        "joining",
        "analysis",
        "overlay",
        "simulation",
        "demo",
        "deploy",
        "rides",
        "web",
    },
    "kickstand_fleet": {
        "checks.bends",
        "checks.sensor",
        "common",
        "signals",
        "logs",
        "calibration",
        "analysis",
        "simulation.ride",
        "cli.common",
    },
    "kickstand_emulator": {
        "common",
        "logs.source",
        "replay.replay_engine",
        "simulated_board",
        "simulation.scripted",
        "demo",
        "deploy",
        "cli.common",
    },
    "kickstand_workshop": {
        "common",
        "signals",
        "logs",
        "checks",
        "calibration",
        "estimation",
        "replay",
        "simulated_board",
        "simulation",
        "demo",
        "deploy",
        "pictures",
        "web",
        "cli",
        "kickstand_emulator",
    },
}


def modules():
    """Yield the folder and the path of each module. For a module outside any folder, its own name replaces the
    folder."""
    package = firmware_path.PACKAGE
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package)
        yield (place.parts[0] if len(place.parts) > 1 else place.stem), path


def imports(path, package=None):
    """Yield each import of the firmware's own modules: the module's name below kickstand, and True if the import is
    within a function."""
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
    """Return True if the folder may import target, a dotted module below kickstand."""
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
    """The check finds a backward import, also within a function, and an import that is only allowed within a function.
    It accepts allowed imports."""
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
    """Every allowed import exists."""
    used = {}
    for folder, path in modules():
        for target, _ in imports(path):
            used.setdefault(folder, set()).add(target)
    for folder, targets in ARROWS.items():
        for target in targets | LATE.get(folder, set()):
            there = any(name == target or name.startswith(target + ".") for name in used.get(folder, ()))
            assert there, f"{folder} no longer imports {target}"


def test_no_module_imports_itself_by_way_of_others():
    """The test includes imports within functions."""
    package = firmware_path.PACKAGE
    found = {".".join(path.relative_to(package).with_suffix("").parts): imports(path) for _, path in modules()}
    graph = TopologicalSorter({name: {target or "__init__" for target, _ in seen} for name, seen in found.items()})
    graph.prepare()  # raises CycleError


def test_mathematics_knows_no_hardware():
    for folder, path in modules():
        if not {folder, f"{folder}.{path.stem}"} & DRIVERS and not path.stem.endswith("_viper"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                names += [node.module] if isinstance(node, ast.ImportFrom) and not node.level and node.module else []
                assert not HARDWARE & set(names), f"{path.name} imports {names}"


def tool_packages():
    """Return {name: directory} of the packages of the tools."""
    tools = firmware_path.TOOLS
    found = {name: tools / name for name in ("kickstand_tools", "kickstand_fleet", "kickstand_emulator")}
    return found | {"kickstand_workshop": tools / "workshop" / "kickstand_workshop"}


def dotted(package, path):
    """Return the dotted name of a module, or of a package's folder."""
    parts = [package.name, *path.relative_to(package).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def is_tool(name):
    """Return True for the dotted name of a module or folder of the tools."""
    package, *parts = name.split(".")
    place = tool_packages()[package].joinpath(*parts)
    return place.is_dir() or place.with_suffix(".py").exists()


def tool_imports(text, within):
    """Return the full names of the tools' modules that a module imports, also within functions and for type checking.

    text: source of the module.
    within: the parts of its package's name.
    """
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parts = within[: len(within) - node.level + 1] if node.level else []
            base = ".".join([*parts, *([node.module] if node.module else [])])
            if base.partition(".")[0] not in tool_packages():
                continue
            names = [f"{base}.{alias.name}" if is_tool(f"{base}.{alias.name}") else base for alias in node.names]
        else:
            continue
        yield from (name for name in names if name.partition(".")[0] in tool_packages())


@functools.cache
def tool_modules():
    """Return {full name: the full names of its imports} of each module of the tools."""
    found = {}
    for package in tool_packages().values():
        for path in sorted(package.rglob("*.py")):
            within = [package.name, *path.relative_to(package).parts[:-1]]
            name = dotted(package, path)
            found[name] = set(tool_imports(path.read_text(encoding="utf-8"), within)) - {name}
    return found


def shortened(name):
    """Convert a full name to the form in TOOL_ARROWS, which omits kickstand_tools for a module of the core."""
    return name.removeprefix("kickstand_tools.")


def is_below(name, place):
    return name == place or name.startswith(place + ".")


def tool_arrows(modules):
    """Yield the folder of each module, and its imports from other folders."""
    for name, targets in modules.items():
        folder = shortened(name).partition(".")[0]
        yield from ((folder, shortened(target)) for target in targets if not is_below(shortened(target), folder))


def forbidden(modules):
    arrows = tool_arrows(modules)
    return [(a, b) for a, b in arrows if not any(is_below(b, place) for place in TOOL_ARROWS[a])]


def test_no_tool_imports_what_it_may_not():
    assert forbidden(tool_modules()) == []


def test_each_folder_of_the_tools_has_its_arrows():
    folders = {shortened(name).partition(".")[0] for name in tool_modules()}
    assert folders - {"kickstand_tools"} == set(TOOL_ARROWS)


def test_no_arrow_of_the_tools_is_left_over():
    used = set(tool_arrows(tool_modules()))
    for folder, places in TOOL_ARROWS.items():
        for place in places:
            assert any(a == folder and is_below(b, place) for a, b in used), f"{folder} no longer imports {place}"


def test_the_core_may_import_no_leaf():
    for folder, places in TOOL_ARROWS.items():
        assert folder in LEAVES or not places & (LEAVES | {"cli"}), folder


def test_no_tool_imports_itself_by_way_of_others():
    """The test includes imports within functions and for type checking only."""
    TopologicalSorter(tool_modules()).prepare()  # raises CycleError


def test_a_wrong_arrow_of_the_tools_is_noticed():
    lines = (
        "from ..signals import Array",
        "def f():\n    import kickstand_fleet.run",
        "if TYPE_CHECKING:\n    from ..cli import common",
        "from . import log",
    )
    found = set(tool_imports("\n".join(lines), ["kickstand_tools", "logs"]))
    assert "kickstand_tools.logs.log" in found
    wrong = {b for _, b in forbidden({"kickstand_tools.logs.reader": found})}
    assert wrong == {"kickstand_fleet.run", "cli.common"}
