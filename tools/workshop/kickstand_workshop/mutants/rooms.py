"""The rooms whose tests are judged by mutants: the code of each and the tests that ought to notice a change in it."""

from pathlib import Path
from typing import NamedTuple

FIRMWARE, TOOLS, TESTS = "firmware/kickstand/", "tools/kickstand_tools/", "host_tests/"


class Room(NamedTuple):
    """sources, tests: patterns of files, from the project's root; the tests in the order in which they run, so those
    that notice most in least time first; before them all that of the same name as the code."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]


ROOMS = {
    "imu": Room(
        (FIRMWARE + "imu/*.py",),
        (
            TESTS + "imu/test_batches.py",
            TESTS + "imu/test_sensor.py",
            TESTS + "imu/test_sample_clock.py",
            TESTS + "imu/test_registers.py",
        ),
    ),
    "calibration": Room(
        (FIRMWARE + "calibration/*.py", FIRMWARE + "rotation.py"),
        (
            TESTS + "calibration/test_rotation.py",
            TESTS + "calibration/test_calibration.py",
            TESTS + "calibration/test_still_pose.py",
            TESTS + "calibration/test_pose_taker.py",
            TESTS + "calibration/test_active.py",
            TESTS + "calibration/test_two_position.py",
            TESTS + "imu/test_batches.py",
            TESTS + "calibration/test_store.py",
        ),
    ),
    "board": Room(
        (FIRMWARE + "board/*.py",),
        (TESTS + "imu/test_drivers.py", TESTS + "simulated_board/test_board_lcd.py", TESTS + "device/*.py"),
    ),
    "lean": Room(
        (FIRMWARE + "lean/*.py",),
        (
            TESTS + "lean/test_known_ride.py",
            TESTS + "lean/test_filter_states.py",
            TESTS + "lean/test_[bkmru]*.py",
            TESTS + "lean/test_formula.py",
            TESTS + "lean/test_lean_filter.py",
        ),
    ),
    "drive_alignment": Room(
        (FIRMWARE + "drive_alignment/*.py",),
        (TESTS + "drive_alignment/test_parts.py", TESTS + "drive_alignment/*.py"),
    ),
    "speed": Room(
        (FIRMWARE + "speed/*.py",),
        (TESTS + "simulated_board/test_board_speed.py", TESTS + "simulated_board/test_board_place.py"),
    ),
    "ui": Room(
        (FIRMWARE + "ui/*.py",),
        (TESTS + "ui/*.py",),
    ),
    "rides": Room(
        (FIRMWARE + "rides/*.py",),
        tuple(TESTS + f"rides/test_{name}.py" for name in ("block", "recording", "ring", "stream", "card_trial")),
    ),
    "pull": Room(
        (TOOLS + "rides/*.py",),
        (TESTS + "rides/test_ride_file.py", TESTS + "rides/test_cli_*.py"),
    ),
    "calibrate": Room(
        (TOOLS + "calibration/*.py",),
        (TESTS + "calibration/test_cli*.py", TESTS + "drive_alignment/test_cli_drive.py"),
    ),
    "broken logs": Room(
        tuple(TOOLS + f"logs/{name}.py" for name in ("even_times", "frozen", "stretch")),
        tuple(TESTS + f"logs/{name}.py" for name in ("test_ends", "test_even_times", "test_frozen", "test_stretch")),
    ),
    "logs": Room(
        tuple(TOOLS + f"logs/{name}.py" for name in ("block", "cells", "csv_reader", "log", "reader", "source")),
        tuple(TESTS + f"logs/{name}.py" for name in ("test_log", "test_cells", "test_cli_logs", "test_log_blocks")),
    ),
    "signals": Room((TOOLS + "signals/*.py",), (TESTS + "signals/*.py",)),
    "checks": Room((TOOLS + "checks/*.py",), (TESTS + "checks/test_[bcms]*.py", TESTS + "checks/test_handedness.py")),
    "replay": Room((TOOLS + "replay/*.py",), (TESTS + "replay/test_cli_replay.py",)),
    "analysis": Room(
        (TOOLS + "analysis/*.py", TOOLS + "analysis/plot/*.py"),
        (TESTS + "analysis/*.py", TESTS + "analysis/stops/*.py"),
    ),
    "export": Room(
        (TOOLS + "analysis/export/*.py",),
        (TESTS + "analysis/test_export_formats.py", TESTS + "analysis/test_cli_export.py"),
    ),
    "stops": Room(
        (TOOLS + "analysis/stops/*.py",),
        (
            TESTS + "analysis/stops/test_stops_closed_form.py",
            TESTS + "analysis/stops/test_speed_fit.py",
            TESTS + "analysis/stops/test_quiet.py",
            TESTS + "analysis/stops/test_analysis_standstill.py",
            TESTS + "analysis/stops/test_analysis_brake_test.py",
        ),
    ),
    "fleet": Room(
        tuple(
            TOOLS + f"fleet/{name}.py"
            for name in ("evidence", "files", "forward", "journal", "manifest", "moved", "period", "run", "tables")
        ),
        tuple(  # not test_cluster.py, which takes longer than all of them
            TESTS + f"fleet/test_{name}.py"
            for name in ("evidence", "moved", "forward", "period", "full_disk", "s3_store", "manifest")
        ),
    ),
    "simulation": Room(
        (TOOLS + "simulation/*.py", TOOLS + "simulation/physics/*.py", TOOLS + "simulation/scripted/*.py"),
        (TESTS + "simulation/*.py",),
    ),
}
UNTESTABLE = ("_viper.py", "_guest.py")  # they run on a board or on MicroPython only


def sources(room: Room, root: Path) -> list[Path]:
    """The files of the room's code, relative to root."""
    return [path for path in _files(room.sources, root) if not path.name.endswith(UNTESTABLE)]


def tests(room: Room, root: Path) -> list[Path]:
    """The files of the room's tests, relative to root."""
    return [path for path in _files(room.tests, root) if path.name.startswith("test_")]


def _files(patterns: tuple[str, ...], root: Path) -> list[Path]:
    found = {path.relative_to(root): None for pattern in patterns for path in sorted(root.glob(pattern))}
    return list(found)
