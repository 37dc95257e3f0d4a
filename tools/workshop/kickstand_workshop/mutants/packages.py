"""Lists the packages whose tests can be judged. Each has its code, and the tests that should notice changes of it."""

from pathlib import Path
from typing import NamedTuple

UNTESTABLE = ("_viper.py", "_guest.py")  # files that run only on a board or on MicroPython


class Package(NamedTuple):
    """A package with its tests.

    sources: Patterns of the files of the code, relative to the project's root.
    tests: Patterns of the files of the tests, in their running order. The fastest and most sensitive tests come first.
        Tests with the same name as the changed file run before all others.
    """

    sources: tuple[str, ...]
    tests: tuple[str, ...]


def _package(sources: str, tests: str) -> Package:
    return Package(tuple(sources.split()), tuple(f"host_tests/{name}.py" for name in tests.split()))


_STOPS = "stops_closed_form speed_fit quiet analysis_standstill analysis_brake_test"
PACKAGES = {
    "imu": _package(
        "firmware/kickstand/imu/*.py", "imu/test_batches imu/test_axis_judge imu/test_sensor imu/test_[!d]*"
    ),
    "calibration": _package(
        "firmware/kickstand/calibration/*.py firmware/kickstand/rotation.py",
        "calibration/test_rotation calibration/test_calibration calibration/test_still_pose calibration/test_pose_taker"
        " calibration/test_active calibration/test_two_position imu/test_batches calibration/test_store",
    ),
    "lean": _package(
        "firmware/kickstand/lean/*.py",
        "lean/test_known_ride lean/test_filter_states lean/test_filter_parts lean/test_[bkm]* lean/test_*",
    ),
    "drive_alignment": _package(
        "firmware/kickstand/drive_alignment/*.py",
        "drive_alignment/test_events drive_alignment/test_stops drive_alignment/test_background"
        " drive_alignment/test_drive_alignment",
    ),
    "speed": _package(
        "firmware/kickstand/speed/*.py", "simulated_board/test_board_speed simulated_board/test_board_place"
    ),
    "ui": _package("firmware/kickstand/ui/*.py", "ui/*"),
    "rides": _package(
        "firmware/kickstand/rides/*.py",
        "rides/test_block rides/test_recording rides/test_ring rides/test_stream rides/test_card_trial",
    ),
    "live": _package("firmware/kickstand/live/*.py", "live/test_bonds live/test_live_packets live/test_live_device"),
    "board": _package(
        "firmware/kickstand/board/*.py",
        "simulated_board/test_board_parts simulated_board/test_board_display simulated_board/test_board_[io]*"
        " device/test_boards",
    ),
    "firmware": _package(  # the modules outside folders
        "firmware/kickstand/[!r]*.py",
        "device/test_settings_limits device/test_state device/test_console_words device/test_diagnosis_cases"
        " device/test_user_code_calls device/test_app_turns device/test_app_loop device/test_start_choices"
        " device/test_status_lines device/test_opened_devices device/test_boards device/test_who_is_there",
    ),
    "published": _package("tools/kickstand_tools/calibration/published.py", "drive_alignment/test_published"),
    "aligning": _package(
        "tools/kickstand_tools/calibration/[!p]*.py tools/kickstand_tools/calibration/p[or]*.py",
        "calibration/test_aligning_parts calibration/test_poses_of_logs drive_alignment/test_feed"
        " calibration/test_sensor_fit calibration/test_cli_calibration_file"
        " calibration/test_cli_calibrate drive_alignment/test_cli_drive",
    ),
    "logs": _package(
        "tools/kickstand_tools/logs/*.py",
        "logs/test_csv_limits logs/test_reader_limits logs/test_log_parts logs/test_[!cm]* logs/test_c*",
    ),
    "imports": _package(
        "tools/kickstand_tools/imports/**/*.py",
        "imports/test_import* imports/test_[lf]*_limits imports/test_app_signs imports/test_[!a]* imports/test_apps",
    ),
    "joining": _package(
        "tools/kickstand_tools/joining/*.py",
        "joining/test_fit_limits joining/test_match_limits joining/test_joining_parts joining/test_track_steps"
        " joining/test_matching joining/test_c* imports/test_joining",
    ),
    "estimation": _package(
        "tools/kickstand_tools/estimation/*.py",
        "estimation/test_[efnpw]* estimation/test_solver estimation/test_smooth estimation/test_alignment",
    ),
    "analysis": _package(
        "tools/kickstand_tools/analysis/*.py tools/kickstand_tools/analysis/plot/*.py",
        "analysis/test_analysis_parts analysis/test_report_words analysis/test_chart_parts analysis/test_ride_blocks"
        " analysis/test_drawn_values analysis/test_riding analysis/test_analysis_channels"
        " analysis/test_al* analysis/test_c* analysis/test_map",
    ),
    "overlay": _package(
        "tools/kickstand_tools/overlay/[!gp]*.py tools/kickstand_tools/overlay/gpmf.py",
        "overlay/test_[ov]* overlay/test_shown overlay/test_c*",
    ),
    "gauge": _package(  # mostly drawings
        "tools/kickstand_tools/overlay/gauge.py tools/kickstand_tools/overlay/parts.py",
        "overlay/test_gauge* overlay/test_overlay_choices",
    ),
    "deploy": _package(
        "tools/kickstand_tools/deploy/*.py",
        "deploy/test_c*_limits deploy/test_check_order deploy/test_update_limits deploy/test_*_parts"
        " deploy/test_config_[ft]*"
        # these flash and check whole boards, and run only if the others noticed nothing
        " deploy/test_others deploy/test_c[ho]* deploy/test_update deploy/test_[nm]* deploy/test_cli_flash",
    ),
    "simulation": _package(
        "tools/kickstand_tools/simulation/**/*.py",
        "simulation/test_physics simulation/test_rides simulation/test_scripted",
    ),
    "pull": _package(
        "tools/kickstand_tools/rides/*.py",
        "rides/test_pull_parts rides/test_ride_file rides/test_stream rides/test_cli_pull rides/test_cli_record",
    ),
    "common": _package(
        "tools/kickstand_tools/common/*.py",
        "cli/test_common_parts cli/test_output cli/test_blame cli/test_added_commands api/test_remedies",
    ),
    "cli": _package(
        "tools/kickstand_tools/cli/*.py",
        "cli/test_printed_lines cli/test_options cli/test_cli_usage cli/test_blame cli/test_added_commands"
        " calibration/test_cli_calibration_file",
    ),
    "simulated_board": _package(
        "tools/kickstand_tools/simulated_board/*.py tools/kickstand_tools/simulated_board/fakes/*.py",
        "simulated_board/test_board_models simulated_board/test_[lop]* simulated_board/test_sensor_models"
        " simulated_board/test_board_[!m]*"
        " simulated_board/test_gps_hostile"
        " imu/test_registers imu/test_sensor device/test_boards",
    ),
    "demo": _package(
        "tools/kickstand_tools/demo/*.py",
        "demo/test_hand_bike demo/test_demo_[ps]* simulation/test_rides demo/test_demo",
    ),
    "web": _package(
        "tools/kickstand_tools/web/*.py",
        "web/test_web_parts web/test_rides_g* web/test_try_device web/test_sample_ride web/test_page_device"
        " web/test_site",  # tests in a browser, which run only if the other tests noticed nothing
    ),
    "fleet": _package(
        "tools/kickstand_fleet/**/*.py",
        "fleet/test_*_parts fleet/test_simulated_* fleet/test_journal fleet/test_evidence fleet/test_manifest"
        " fleet/test_moved fleet/test_forward fleet/test_period fleet/test_full_disk fleet/test_fleet_page",
    ),
    "emulator": _package(  # the other modules run only with an emulated chip, whose tests take minutes
        "tools/kickstand_emulator/console_*.py tools/kickstand_emulator/device.py tools/kickstand_emulator/flash*.py"
        " tools/kickstand_emulator/host*.py tools/kickstand_emulator/i*.py",
        "chip/test_emulator_parts",
    ),
    "signals": _package("tools/kickstand_tools/signals/*.py", "signals/*"),
    "checks": _package("tools/kickstand_tools/checks/*.py", "checks/*"),
    "replay": _package("tools/kickstand_tools/replay/*.py", "replay/test_meter_along replay/test_cli_replay"),
    "export": _package(
        "tools/kickstand_tools/analysis/export/*.py",
        "analysis/test_export_formats analysis/test_export_positions analysis/test_cli_export",
    ),
    "stops": _package(
        "tools/kickstand_tools/analysis/stops/*.py", " ".join(f"analysis/stops/test_{name}" for name in _STOPS.split())
    ),
}


def sources(package: Package, root: Path) -> list[Path]:
    """Return the files of the package's code, relative to root."""
    return [path for path in _files(package.sources, root) if not path.name.endswith(UNTESTABLE)]


def tests(package: Package, root: Path) -> list[Path]:
    """Return the files of the package's tests, relative to root."""
    return [path for path in _files(package.tests, root) if path.name.startswith("test_")]


def _files(patterns: tuple[str, ...], root: Path) -> list[Path]:
    found = {path.relative_to(root): None for pattern in patterns for path in sorted(root.glob(pattern))}
    return list(found)
