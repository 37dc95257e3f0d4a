"""Which parts may import which, in the firmware and in the tools.

A sample takes the path imu -> calibration -> lean -> ui. The folders drive_alignment, speed and rides are beside this
path. The app connects all folders. In the tools, kickstand_fleet, kickstand_emulator and the workshop are leaves: the
core, kickstand_tools, imports none of them and finds their commands by entry points.
"""

import functools
from graphlib import TopologicalSorter

import pytest
from kickstand_workshop.reach import HARDWARE, import_graph

ANY = {"errors", "units", "rotation", "quick"}  # any part of the firmware may import these


def parts_of(table):
    """Return {part: the other parts that it may import}. A line has a part and others; # begins a comment."""
    parts = {}
    for line in table.splitlines():
        if words := line.partition("#")[0].split():
            parts.setdefault(words[0], set()).update(words[1:])
    return parts


# A part of the firmware is a folder, or a module outside the folders
FIRMWARE = parts_of("""
errors           console
quick            board.plain_code
quick_viper
units
rotation
console
board                # pins, bus, button, display and card, without mathematics
imu
calibration
lean             calibration
drive_alignment  calibration.vectors  # the app passes the calibrations to it
speed            board
rides            board calibration  # each block of a ride contains the record of its calibration
live
ui               board.button board.display lean calibration drive_alignment
settings         setting_table board imu diagnosis  # also opens the parts
setting_table    board imu.mpu6050  # for the ranges that can be set
diagnosis        imu
facts            board.display calibration console diagnosis imu rides settings speed ui.messages
app              board calibration drive_alignment lean rides speed ui user_code
user_code
start            app board console live settings ui.messages
__init__         facts
""")
DRIVERS = {"board", "imu", "speed", "settings", "diagnosis", "start", "live.radio"}

CORE = {"kickstand_tools", "kickstand_sim"}
LEAVES = {"kickstand_fleet", "kickstand_emulator", "kickstand_workshop"}
# A part of the tools is a folder or module of the core, or a leaf
TOOLS = parts_of("""
common
signals             # uses numpy only, no logs and no files
logs                common signals  # a reader judges nothing
checks              common signals logs
calibration         common signals logs checks
estimation          common signals logs checks calibration
replay              common signals logs checks calibration
imports             common signals logs checks estimation.alignment
joining             common signals logs checks calibration estimation replay
analysis            common signals logs checks calibration estimation replay.replay
overlay             common signals logs checks.log calibration.file joining.motion analysis
simulated_board
simulation          common signals logs.csv_text
demo                common simulated_board simulation.scripted
deploy              common simulated_board  # tries config.py on the simulated board
rides               common logs calibration.file deploy replay.replay_engine
web                 common logs calibration estimation imports joining analysis simulated_board simulation
web                 demo.hand_bike deploy rides
api                 common logs calibration checks.log estimation replay imports joining analysis overlay
api                 simulation web.site
cli                 common logs checks calibration estimation replay imports joining analysis overlay simulation
cli                 demo deploy rides web
kickstand_fleet     common signals logs checks calibration analysis simulation.ride cli.common
kickstand_emulator  common logs.source replay.replay_engine simulated_board simulation.scripted demo deploy cli.common
kickstand_workshop  common signals logs calibration estimation replay simulated_board simulation demo web cli api
""")


@functools.cache
def graph():
    return import_graph()


def shortened(module):
    """Return the name of a module as in the tables."""
    short = module.removeprefix("kickstand_tools.").removeprefix("kickstand_sim.").removeprefix("kickstand.")
    return "__init__" if module == "kickstand" else short


def arrows(packages):
    """Return {(part, imported module)} of all imports from one part to another within these packages."""
    pairs = set()
    for module, targets in graph().items():
        part = shortened(module).partition(".")[0]
        inside = {shortened(target) for target in targets if target.partition(".")[0] in packages}
        if module.partition(".")[0] in packages:
            pairs |= {(part, target) for target in inside if target.partition(".")[0] not in (part, *CORE)}
    return pairs


def is_allowed(part, target, table, always=()):
    return any(f"{target}.".startswith(f"{allowed}.") for allowed in (*table[part], *always))


FIRMWARE_PACKAGES, TOOL_PACKAGES = {"kickstand"}, {*CORE, *LEAVES}
TABLES = [(FIRMWARE_PACKAGES, FIRMWARE, ANY), (TOOL_PACKAGES, TOOLS, set())]


@pytest.mark.parametrize(("packages", "table", "always"), TABLES, ids=["firmware", "tools"])
def test_each_part_imports_only_what_it_may(packages, table, always):
    imports = arrows(packages)
    parts = {shortened(module).partition(".")[0] for module in graph() if module.partition(".")[0] in packages}
    assert parts - CORE == set(table)
    assert [(part, target) for part, target in imports if not is_allowed(part, target, table, always)] == []
    for part, targets in table.items():
        imported = [target for importer, target in imports if importer == part]
        unused = {name for name in targets if not any(f"{target}.".startswith(f"{name}.") for target in imported)}
        assert unused == set(), f"{part} no longer imports them"


def test_a_wrong_arrow_is_noticed():
    assert not is_allowed("imu", "lean.meter", FIRMWARE, ANY)
    assert not is_allowed("imu", "console", FIRMWARE, ANY) and is_allowed("imu", "errors", FIRMWARE, ANY)
    assert not is_allowed("logs", "kickstand_fleet.run", TOOLS) and is_allowed("logs", "signals.rotation", TOOLS)
    assert ("ui", "lean.bike_model") in arrows(FIRMWARE_PACKAGES)


def test_no_module_imports_itself_by_way_of_others():
    TopologicalSorter(graph()).prepare()


def test_the_core_imports_no_leaf():
    for part, targets in TOOLS.items():
        assert part in LEAVES or not targets & (LEAVES | {"cli"}), part


def test_only_drivers_import_hardware():
    for module, targets in graph().items():
        if module.startswith("kickstand.") and not module.endswith("_viper") and targets & HARDWARE:
            short = shortened(module)
            assert {short, short.partition(".")[0]} & DRIVERS, f"{module} imports {targets & HARDWARE}"
