"""The lines that the commands print for known results. The computations are replaced, because other tests test them."""

import contextlib
import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from kickstand.drive_alignment import verdict
from kickstand_tools.calibration import drive_events as events
from kickstand_tools.calibration.drive import DriveFit, PoseCheck
from kickstand_tools.calibration.file import CalibrationFile, write_calibration
from kickstand_tools.calibration.poses import SixPositions, TwoPositions
from kickstand_tools.cli import board, calibrate, common, main, ride, without_a_board
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import Plain, WrongAxes
from kickstand_tools.estimation.alignment import RideFit
from kickstand_tools.imports.recording import Taken
from kickstand_tools.joining.match import Match
from kickstand_tools.logs.log import Stretch
from kickstand_tools.rides.pull import PulledRide, PullResult
from kickstand_tools.rides.stream import LiveReading
from support import command

KNOWN = CalibrationFile(
    accel_offset_g=np.array([0.01, -0.02, 0.03]),
    accel_slope=np.array([1.01, 0.99, 1.0]),
    gyro_bias_dps=np.array([1.0, -2.0, 0.5]),
    aligned=True,
    six_done=True,
    kickstand_side="right",
)
DRIVEN = DriveFit(
    KNOWN, "car", "improved", used=9, turned=3, stops=4, quality_deg=0.84, ready_s=61.0, lag_s=0.42, halves_deg=0.31,
    poses=None, events=[], notices=[], bias_dps=np.zeros(3),
)  # fmt: skip
RIDDEN = RideFit(
    KNOWN, roll_deg=0.5, pitch_deg=0.6, yaw_deg=0.7, halves_deg=(-0.1, 0.2, -0.3), offset_g=np.zeros(3),
    offset_sigma_g=np.zeros(3), used_s=(-0.4, 300.0), riding_s=200.0, standing_s=50.0, lean_deg=17.0, lag_s=-0.2,
    phone_deg=None, notices=[],
)  # fmt: skip
READING = LiveReading(
    aligned=True, car=False, moments=[(0.0, 1.0, 0.1, None), (0.1, 2.0, 0.2, None), (0.2, -30.0, 0.25, None)],
    max_left_deg=0.0, max_right_deg=0.0, max_accel_g=0.0, max_brake_g=0.0, rate_hz=49.6, seconds=65.0,
)  # fmt: skip


class MirroredAxes(WrongAxes):
    text = "the axes are mirrored"


def pose(name, samples=300) -> Any:
    return SimpleNamespace(name=name, samples=samples)


def six_positions(**changed):
    sides = [pose(f"{k}.csv", 300 + k) for k in range(6)]
    return dataclasses.replace(SixPositions(KNOWN, sides, [0.1 * k for k in range(6)], None, None, []), **changed)


def lines(found):
    return list(calibrate._six_lines(found))


def test_six_positions_are_listed_with_their_poses():
    found = lines(six_positions())
    assert found[:2] == [
        "+x up: 0.csv, 300 samples, 0.0 degrees off its axis",
        "-x up: 1.csv, 301 samples, 0.1 degrees off its axis",
    ]
    assert found[6:9] == [
        "offset     x +0.0100 g  y -0.0200 g  z +0.0300 g",
        "slope      x 1.0100  y 0.9900  z 1.0000",
        "gyro bias  x +1.00 deg/s  y -2.00 deg/s  z +0.50 deg/s",
    ]
    assert found[9].startswith("warning: no free pose") and found[10].startswith("not aligned yet") and len(found) == 11


@pytest.mark.parametrize(
    ("error_g", "words"), [(-0.004, "-4.0 mg from 1 g: good"), (0.02, "+20.0 mg from 1 g: usable")]
)
def test_a_free_pose_is_good_or_usable(error_g, words):
    found = lines(six_positions(free_pose=pose("f.csv"), free_pose_error_g=error_g, beyond_sheet=["x", "z"]))
    assert found[6].startswith(f"free pose: f.csv, 300 samples, {words}")
    assert "warning: x, z is beyond the data sheet (50 mg, z 80 mg, slope 3 %): used anyway" in found
    assert not any("no free pose" in line for line in found)
    assert not any(line.startswith("free pose") for line in lines(six_positions(free_pose=pose("f.csv"))))


def test_turns_between_the_poses_give_the_gyros_scale():
    known = dataclasses.replace(
        KNOWN, gyro_matrix=np.diag([1 / 1.01, 1 / 0.98, 1.0]), gyro_sigma=np.diag([0.001, 0.003, 0.002])
    )
    found = lines(six_positions(calibration=known, turns=5, all_turns=5))
    assert "gyro scale  x +1.00 %  y -2.00 %  z +0.00 %, by 5 turns, known to 0.3 %" in found
    assert not any("left out" in line for line in found)
    found = lines(six_positions(calibration=known, turns=5, all_turns=7))
    assert any("warning: 2 of 7 turns left out" in line for line in found)


@pytest.mark.parametrize(("tilt_deg", "warned"), [(7.9, True), (8.1, False)])
def test_two_poses_that_are_too_alike_are_warned_of(tilt_deg, warned):
    found = list(calibrate._two_lines(TwoPositions(KNOWN, pose("k"), pose("u", 200), tilt_deg)))
    assert found[:2] == [
        "kickstand: k, 300 samples",
        f"upright:   u, 200 samples, {tilt_deg} degrees from the kickstand on the right",
    ]
    assert found[3:6] == [
        "left       x +1.0000  y +0.0000  z +0.0000",
        "up         x +0.0000  y +1.0000  z +0.0000",
        "forward    x +0.0000  y +0.0000  z +1.0000",
    ]
    assert any(line.startswith("warning: under 8 degrees") for line in found) is warned
    assert not any("no six-position" in line for line in found)
    rough = dataclasses.replace(KNOWN, six_done=False)
    assert "no six-position" in list(calibrate._two_lines(TwoPositions(rough, pose("k"), pose("u"), 12.0)))[-1]


def test_a_drive_is_described():
    found = list(calibrate._drive_lines(DRIVEN, True))
    assert found[0] == "car, method improved: 9 used, 3 in turns not used"
    assert found[1] == "stops: 4"
    assert found[2].startswith("quality: 0.8 degrees about the vertical, ") and found[2].endswith(
        "after 61 s of all logs"
    )
    assert found[3] == "speed: 0.4 s late; two halves of the drive differ by 0.3 degrees"
    alone = list(calibrate._drive_lines(dataclasses.replace(DRIVEN, lag_s=None), False))
    assert alone[2].endswith("ready after 61 s") and not any(line.startswith("speed") for line in alone)
    rough = dataclasses.replace(DRIVEN, calibration=dataclasses.replace(KNOWN, six_done=False))
    assert list(calibrate._drive_lines(rough, False))[-1].endswith("calibrate six first")


@pytest.mark.parametrize(
    ("seen", "yaw_deg", "words"),
    [
        (verdict.REVERSED, 178.0, "had forward and backward exchanged"),
        (verdict.MOVED, -12.4, "the mount is 12 degrees off its place"),
        (None, -3.0, "the two poses had forward 3.0 degrees off, which usually costs about "),
        (None, 0.04, "the two poses had forward 0.0 degrees off: now corrected"),
    ],
)
def test_a_drive_corrects_or_doubts_the_two_poses(seen, yaw_deg, words):
    found = dataclasses.replace(DRIVEN, poses=PoseCheck(-1 if seen is None else seen, yaw_deg))
    assert any(words in line for line in calibrate._drive_lines(found, False))


def event(what, counted=3, refusal=None):
    return events.DriveEvent("a.csv", 12.34, what, counted, 8, 1.26, refusal)


def test_each_event_of_a_drive_is_one_line():
    def said(one, several=False):
        return list(calibrate._event_lines(one, several))

    refused = Plain("the speed is late")
    assert said(event(events.USED)) == ["   12.3 s  in a straight line: event 3 of 8 needed"]
    assert said(event(events.USED, 8)) == ["   12.3 s  in a straight line: event 8 of 8 needed"]
    assert said(event(events.USED, 9)) == ["   12.3 s  in a straight line: event 9"]
    assert said(event(events.TURNING)) == ["   12.3 s  in a turn: not counted"]
    assert said(event(events.READY)) == ["   12.3 s  ready: forward known to 1.3 degrees"]
    assert said(event(events.NOT_READY)) == ["   12.3 s  no longer ready"]
    assert said(event(events.NOT_READY, refusal=refused)) == ["   12.3 s  no longer ready: the speed is late"]
    assert said(event(events.PROBLEM, refusal=refused)) == ["   12.3 s  the speed is late"]
    assert said(event(events.LOG_BEGINS)) == said(event(events.LOG_WITHOUT_EVENTS)) == []
    assert said(event(events.LOG_BEGINS), True) == ["a.csv:"]
    assert said(event(events.LOG_WITHOUT_EVENTS), True) == ["           no braking in it"]


def test_a_ride_is_described():
    found = list(calibrate._ride_lines(RIDDEN))
    assert found[0] == "used: 0 to 300 s of the log, 50 s of these certainly standing, otherwise leaning 17 degrees rms"
    assert found[1] == "known to: roll 0.5, pitch 0.6, yaw 0.7 degrees"
    assert found[2] == "two halves of the ride differ by: roll 0.1, pitch 0.2, yaw 0.3 degrees"
    assert found[3] == "speed: 0.0 s late"
    other = list(calibrate._ride_lines(dataclasses.replace(RIDDEN, lag_s=None, phone_deg=4.4)))
    assert other[3] == "phone: mounted as --phone says, within 4 degrees"


def test_a_drive_prints_its_events_and_remarks_about_its_logs(tmp_path, monkeypatch):
    cal = command.write_cal(tmp_path / "CAL.json")
    logs = [command.still(tmp_path / name, (0, 1, 0)) for name in ("a.csv", "b.csv")]
    asked = []

    def fit(paths, before, vehicle, method, _progress, event_seen):
        asked.append((len(paths), before is not None, vehicle, method))
        event_seen(event(events.LOG_BEGINS))
        return dataclasses.replace(DRIVEN, notices=[("a.csv", Plain("the speed jumps"))])

    monkeypatch.setattr(calibrate, "fit_drive", fit)
    monkeypatch.setattr(calibrate, "remarks", lambda log, before, axes: [Plain("the mount was moved")])
    done = command.works("calibrate", "drive", *logs, "--calibration", cal, "--out", tmp_path / "NEW.json")
    assert done.out.startswith("a.csv:\n") and "of all logs" in done.out and done.out.endswith("NEW.json\n")
    assert "warning: a.csv: the speed jumps" in done.err
    assert done.err.count("the mount was moved") == 2
    done = command.works("calibrate", "drive", logs[0], "--vehicle", "car", "--out", tmp_path / "NEW.json")
    assert not done.out.startswith("a.csv:") and "of all logs" not in done.out
    assert "the mount was moved" not in done.err
    assert asked == [(2, True, None, "improved"), (1, False, "car", "improved")]


def test_two_poses_print_the_remarks_about_their_mount(tmp_path, monkeypatch):
    given = [command.still(tmp_path / name, (0, 1, 0)) for name in ("k.csv", "u.csv")]
    monkeypatch.setattr(calibrate, "fit_two_positions", lambda *_: TwoPositions(KNOWN, pose("k"), pose("u"), 12.0))
    monkeypatch.setattr(calibrate, "of_calibration", lambda found, before: [Plain("the mount was turned")])
    done = command.works("calibrate", "two", *given, "--out", tmp_path / "CAL.json")
    assert done.err == f"warning: {given[1]}: the mount was turned\n"
    assert json.loads((tmp_path / "CAL.json").read_text())["version"] == 1


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, "          ##########|                     lean -30.0 deg  forward +0.25 g   50 readings/s  1:05.0"),
        (
            {"moments": [(0.0, 4.0, -0.5, None)]},
            f"{'|':>21}#{'lean  +4.0 deg  forward -0.50 g':>51}   50 readings/s  1:05.0",
        ),
        ({"moments": [(0.0, None, 0.0, None)]}, "lean --   50 readings/s  1:05.0"),
        ({"moments": [], "aligned": False}, "not aligned   50 readings/s  1:05.0"),
        ({"moments": [(0.0, None, 0.1, 0.25)]}, "forward +0.10 g  left  0.25 g   50 readings/s  1:05.0"),
        ({"moments": [(0.0, None, -0.1, -0.25)]}, "forward -0.10 g  right 0.25 g   50 readings/s  1:05.0"),
    ],
)
def test_the_last_reading_is_shown_live(changed, words):
    shown = board._live_text(dataclasses.replace(READING, **changed))
    assert shown.split() == words.split()
    assert "#" not in words or shown.index("|") == 20


def test_a_lean_over_60_degrees_fills_the_bar():
    shown = board._live_text(dataclasses.replace(READING, moments=[(0.0, 80.0, 0.0, None)]))
    assert f"{'|':>21}{20 * '#'} lean" in shown


@pytest.mark.parametrize("installed", [True, False])
def test_flash_says_what_it_copied_and_kept(installed, tmp_path, monkeypatch):
    files = SimpleNamespace(copied=["a", "b"], copied_bytes=12_340, kept=["c"], removed=["/x.py"], config_differs=True)
    done = SimpleNamespace(
        board="Pico", port="COM3", config=tmp_path / "config.py", others=["main.py as main_old.py"], unused=["SIDE"],
        why_sources="no mpy-cross", installed=files,
    )  # fmt: skip
    asked = []
    monkeypatch.setattr(board, "flash", lambda *given, **named: asked.append((*given[:2], named["agree"])) or done)
    monkeypatch.setattr(board.firmware_path, "installed", lambda: installed)
    monkeypatch.setattr(board.firmware_path, "directory", lambda: tmp_path)
    said = command.works("flash").out.splitlines()
    assert said[:3] == ["Pico on COM3", "kept: main.py as main_old.py", f"config.py is {tmp_path / 'config.py'}"]
    assert any(line.startswith("to change settings, copy that file") for line in said) is installed
    assert any(line.startswith("note: SIDE is not used") for line in said)
    assert any(line.startswith("note: no mpy-cross") for line in said)
    assert "removed: x.py is no longer part of the firmware" in said
    assert said[-2] == "copied 2 files, 12.3 kB, and verified them; 1 left as they were"
    assert any("--config would replace it" in line for line in said)
    files.removed = [f"/{k}.py" for k in range(5)]
    assert "removed: 4.py is no longer part of the firmware" in command.works("flash").out.splitlines()
    files.removed, files.config_differs = [f"/{k}.py" for k in range(6)], False
    said = command.works("flash").out.splitlines()
    assert "removed: 6 files that are no longer part of the firmware" in said
    assert not any("--config" in line and "kept" in line for line in said)
    assert set(asked) == {(None, False, board._agree)}
    command.works("flash", "--yes", "--config", "--port", "COM3")
    assert asked[-1] == ("COM3", True, None)


def test_check_ends_with_status_1_if_a_figure_is_at_fault(monkeypatch):
    for faults, status in (([], 0), (["x"], 1)):
        monkeypatch.setattr(board, "check", lambda *_, faults=faults: SimpleNamespace(findings=[], faults=faults))
        monkeypatch.setattr(board, "verdict", lambda _: "the verdict")
        done = command.run("check")
        assert (done.status, done.out) == (status, "the verdict\n")


def test_pull_reports_each_ride(monkeypatch, tmp_path):
    rides = [PulledRide(1, Path("1.csv"), 90.0, 1234, deleted=True), PulledRide(2, problems=["it is damaged"])]

    def pull(_port, _out, _delete, _progress, say):
        for one in rides:
            say(one)
        return PullResult("COM3", rides)

    monkeypatch.setattr(board, "pull", pull)
    done = command.works("pull", "--delete", "--out", tmp_path)
    assert done.out == "written: 1.csv, 1.5 min, 1234 readings\ndeleted from the board: ride 1\n"
    assert done.err.splitlines() == [
        "warning: it is damaged",
        "warning: ride 2: not deleted from the board, because it was not fetched completely",
    ]
    assert "not deleted" not in command.works("pull", "--out", tmp_path).err
    rides.clear()
    assert "no rides on the board at COM3" in command.works("pull", "--out", tmp_path).out


def test_help_gets_a_paragraph_after_its_own_text():
    def plain():
        """Do it.

        Slowly.
        """

    assert common.help_adds("More.")(plain).__doc__ == "Do it.\n\nSlowly.\n\nMore."


def test_equal_notices_are_printed_once(capsys):
    common.warn("a.csv", [Plain("odd\x1b"), Plain("odd\x1b"), Plain("even")])
    assert capsys.readouterr().err == "warning: a.csv: odd\\x1b\nwarning: a.csv: even\n"


def test_replay_warns_of_a_calibration_that_is_not_aligned(tmp_path, monkeypatch):
    log = command.still(tmp_path / "ride.csv", (0, 1, 0))
    monkeypatch.setattr(ride, "replay_to_csv", lambda *_: (300, []))
    for aligned in (True, False):
        write_calibration(tmp_path / "ride.cal.json", dataclasses.replace(KNOWN, aligned=aligned))
        done = command.works("replay", log, "--out", tmp_path / "LEAN.csv")
        assert ("is not aligned: this is the lean of the sensor" in done.err) is not aligned
        assert done.out == f"written: {tmp_path / 'LEAN.csv'}, 300 samples\n"


@pytest.mark.parametrize("beside", [True, False])
@pytest.mark.parametrize("given", [True, False])
def test_only_an_export_without_calibration_is_aligned_by_bends(beside, given, tmp_path, monkeypatch):
    source = tmp_path / "export.csv"
    source.write_text("not a log")
    found = SimpleNamespace(app="phyphox", log=SimpleNamespace(t_s=np.zeros(5)), rate_hz=99.6)
    monkeypatch.setattr(ride, "import_of_app", lambda _: found)
    monkeypatch.setattr(ride, "fit_ride", lambda *_: dataclasses.replace(RIDDEN, calibration=CalibrationFile()))
    names = [name for name, there in (("export.cal.json", beside), ("other.json", given)) if there]
    for k, name in enumerate(names):
        write_calibration(tmp_path / name, dataclasses.replace(KNOWN, gyro_bias_dps=np.full(3, 1.0 + k)))
    taken = ride._from_export(source, tmp_path / "other.json" if given else None)
    assert taken and taken[0] is found
    # the calibration of the option is used first, then the calibration beside the export
    assert taken[1].gyro_bias_dps[0] == float(len(names))


def test_a_joined_track_says_when_the_ride_began():
    track = SimpleNamespace(utc_s=np.array([1.79e9 + 2.0]))
    match = Match(1.79e9, 50e-6, 0.05, 0.876, 600.0)
    joined: Any = SimpleNamespace(match=match, track=track, own_speed=True)
    said = list(ride._joined_lines(joined))
    assert said == [
        "the ride began at 2026-09-21 14:13:20.00 UTC by the track's clock, +- 0.05 s: 2.00 s before the track's first "
        "point",
        "match: correlation 0.88 over 10.0 minutes",
        "the log's own speed is kept",
    ]
    track.utc_s = np.array([1.79e9 - 3.5])
    fast: Any = SimpleNamespace(match=dataclasses.replace(match, drift=-260e-6), track=track, own_speed=False)
    first, *others = ride._joined_lines(fast)
    assert first.endswith("3.50 s after the track's first point")
    assert others[1:] == ["the ride's clock is 260 ppm fast"]


@pytest.mark.parametrize("text", ["t", "=x", "t=", "t=1,", "t=a,t=b"])
def test_pairs_of_an_option_must_be_whole_and_different(text):
    with pytest.raises(InputError, match="--columns: "):
        ride._pairs(text, "--columns")


def test_pairs_of_an_option():
    assert ride._pairs(" t = a b , ax=#3=", "--columns") == {"t": "a b", "ax": "#3="}
    assert ride._pairs("  ", "--columns") == {}


def test_cut_needs_a_beginning_or_an_end(tmp_path):
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=10.0)
    command.refused(tmp_path, "cut", log, "--out", tmp_path / "b.csv", words="Give --from, --to or both")
    for given in (("--from", 8), ("--to", 2)):
        done = command.works("cut", log, *given, "--out", tmp_path / "b.csv")
        assert "b.csv, 200 samples" in done.out or "b.csv, 201 samples" in done.out


def test_a_refused_question_changes_nothing_on_the_board(monkeypatch):
    monkeypatch.setattr(board.sys, "stdin", SimpleNamespace(isatty=lambda: False))
    with pytest.raises(InputError, match="a; b: run kickstand flash --yes for that"):
        board._agree(["a", "b"])
    monkeypatch.setattr(board.sys, "stdin", SimpleNamespace(isatty=lambda: True))
    for answer in (True, False):
        monkeypatch.setattr(click, "confirm", lambda *_, answer=answer, **__: answer)
        if answer:
            board._agree(["a"])
        else:
            with pytest.raises(InputError, match="nothing was changed"):
                board._agree(["a"])


def test_status_prints_what_the_board_says(monkeypatch):
    monkeypatch.setattr(board, "status", lambda port, wirings: f"{port} {wirings}")
    assert command.works("status").out == "None False\n"
    assert command.works("status", "--port", "COM3", "--wirings").out == "COM3 True\n"


@pytest.mark.parametrize(("count", "name"), [(1, "fit_procedure"), (6, "fit_six_positions")])
def test_six_positions_are_written(count, name, tmp_path, monkeypatch):
    monkeypatch.setattr(calibrate, name, lambda _: six_positions())
    poses = [command.still(tmp_path / f"{k}.csv", (0, 1, 0), seconds=1.0) for k in range(count)]
    done = command.works("calibrate", "six", *poses, "--out", tmp_path / "CAL.json")
    assert done.out.endswith(f"written: {tmp_path / 'CAL.json'}\n")
    assert json.loads((tmp_path / "CAL.json").read_text())["accel_slope"] == [1.01, 0.99, 1.0]


@pytest.mark.parametrize("verb", ["six", "two", "drive", "ride"])
def test_a_calibration_never_overwrites_its_log(verb, tmp_path):
    """The log is refused as output before it is read."""
    log, other = (command.still(tmp_path / name, (0, 1, 0), seconds=1.0) for name in ("a.csv", "b.csv"))
    given = [other, log] if verb == "two" else [log]
    command.refused(tmp_path, "calibrate", verb, *given, "--out", log, words="a.csv is also an input")


def test_a_ride_is_aligned_as_its_phone_was_mounted(tmp_path, monkeypatch):
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)
    asked = []

    def fit(_log, phone, _progress):
        asked.append(phone)
        return dataclasses.replace(RIDDEN, notices=[Plain("the speed is late")])

    monkeypatch.setattr(calibrate, "fit_ride", fit)
    done = command.works("calibrate", "ride", log, "--phone", "flat", "--out", tmp_path / "CAL.json")
    assert asked == ["flat"] and done.err == f"warning: {log}: the speed is late\n"
    assert (tmp_path / "CAL.json").exists()


def test_record_shows_the_last_reading_and_ends_with_its_notes(tmp_path, monkeypatch):
    shown = []

    @contextlib.contextmanager
    def line():
        yield shown.append

    def record(port, out, begin, reading):
        begin("COM3")
        reading(READING)
        calibration = out.with_suffix(".cal.json")
        return SimpleNamespace(log=out, seconds=12.34, readings=600, calibration=calibration, notes=["a block is lost"])

    monkeypatch.setattr(board, "live_line", line)
    monkeypatch.setattr(board, "record", record)
    done = command.works("record", "--out", "a.csv")
    assert done.out == (
        "recording from COM3: press Ctrl-C to stop\nwritten: a.csv, 12.3 s, 600 readings, and a.cal.json\n"
    )
    assert done.err == "warning: a block is lost\n"
    assert shown == [board._live_text(READING)]


@pytest.fixture
def log(tmp_path):
    """Return a log with its calibration beside it."""
    command.write_cal(tmp_path / "a.cal.json")
    return command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)


def test_two_recordings_are_compared_and_drawn_on_request(log, tmp_path, monkeypatch):
    other = command.still(tmp_path / "b.csv", (0, 1, 0), seconds=1.0)
    cal = command.write_cal(tmp_path / "B.json")
    found = SimpleNamespace(notices={"a": [Plain("odd")], "b": [Plain("late")]}, as_data=lambda: {"differ_deg": 1.5})
    drawn = []
    monkeypatch.setattr(ride.agreement, "compare_rides", lambda *_: found)
    monkeypatch.setattr(ride.agreement, "words", lambda _: ["they differ by 1.5 degrees"])
    monkeypatch.setattr(ride.agreement, "check_picture", lambda _: drawn.append("checked"))
    monkeypatch.setattr(ride.agreement, "draw", lambda path, _: drawn.append("drawn") or path.write_text(""))
    given = "compare", log, other, "--calibration-b", cal
    done = command.works(*given)
    assert (done.out, drawn) == ("they differ by 1.5 degrees\n", [])
    assert done.err == f"warning: {log}: odd\nwarning: {other}: late\n"
    done = command.works(*given, "--plot", tmp_path / "p.png")
    assert done.out == f"they differ by 1.5 degrees\nwritten: {tmp_path / 'p.png'}\n"
    assert drawn == ["checked", "drawn"] and (tmp_path / "p.png").exists()
    assert command.works(*given, "--json").out == '{"differ_deg": 1.5}\n'
    command.refused(tmp_path, *given, "--plot", log, words="a.csv is also an input")


@pytest.mark.parametrize(
    ("verb", "more", "name", "result", "words"),
    [
        ("smooth", [], "smooth_to_csv", (300, [Plain("odd")]), "300 samples"),
        ("replay", [], "replay_to_csv", (200, [Plain("odd")]), "200 samples"),
        ("export", ["--to", "gpx"], "export", 70, "70 rows"),
    ],
)
def test_a_written_file_is_named_with_its_size(verb, more, name, result, words, log, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(ride, name, lambda *given: asked.append(given) or result)
    monkeypatch.setattr(ride, "open_ride", lambda *given, **named: asked.append((given, named)) or "opened")
    out = tmp_path / "out.file"
    done = command.works(verb, log, *more, "--out", out)
    assert done.out == f"written: {out}, {words}\n"
    assert ("odd" in done.err) == (verb != "export")
    command.refused(tmp_path, verb, log, *more, "--out", log, words="is also an input")
    command.refused(tmp_path, verb, log, *more, "--out", tmp_path / "a.cal.json", words="is also an input")
    if verb == "export":
        assert asked[0][1] == {"smoothed": True}
        command.works(verb, log, *more, "--live", "--out", out)
        assert asked[2][1] == {"smoothed": False}


@pytest.mark.parametrize("given", [(), ("--from", 1), ("--to", 2), ("--from", 1, "--to", 2)])
def test_only_the_named_stretch_is_replayed(given, log, tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(ride, "replay_to_csv", lambda source, *_: seen.append(source) or (1, []))
    command.works("replay", log, *given, "--out", tmp_path / "out.csv")
    if given:
        options = dict(zip(given[::2], given[1::2], strict=True))
        assert seen == [Stretch(log, options.get("--from"), options.get("--to"))]
    else:
        assert seen == [log]


@pytest.mark.parametrize("found", [True, False])
def test_a_video_says_where_it_begins_if_that_was_found(found, log, tmp_path, monkeypatch):
    asked = []
    made = SimpleNamespace(
        notices=[Plain("odd")], correlation=0.876 if found else None, offset_s=12.345, pictures=300, begin_s=1.0,
        end_s=11.0, fps=29.97,
    )  # fmt: skip
    monkeypatch.setattr(ride, "overlay", lambda *given, **named: asked.append((given, named)) or made)
    out = tmp_path / "o.mov"
    done = command.works("overlay", log, "--fps", 60, "--mph", "--offset", "-1:00", "--out", out)
    assert done.out.endswith(f"written: {out}, 300 frames, 10.0 s, 29.97 per second\n")
    assert ("--offset 12.35" in done.out or "--offset 12.34" in done.out) is found
    assert done.err == f"warning: {log}: odd\n"
    ((_, named),) = asked
    assert named["fps"] == 60.0 and named["mph"] and named["offset_s"] == -60.0 and not named["live"]


def test_a_joined_ride_names_the_next_command(log, tmp_path, monkeypatch):
    track = tmp_path / "t.gpx"
    track.write_text("")
    match = Match(1.79e9, 0.0, 0.05, 0.9, 600.0)
    joined = SimpleNamespace(match=match, track=SimpleNamespace(utc_s=np.array([1.79e9])), own_speed=False, notices=[])
    for name, result in (("read_track", None), ("join_track", joined), ("write_joined", 55)):
        monkeypatch.setattr(ride, name, lambda *_, result=result: result)
    out = tmp_path / "out.csv"
    said = command.works("join", log, track, "--out", out).out
    assert f"written: {out}, 55 positions\n" in said
    assert said.endswith(f"next: kickstand report {out} --calibration {tmp_path / 'a.cal.json'}\n")
    command.write_cal(tmp_path / "out.cal.json")
    assert "next:" not in command.works("join", log, track, "--out", out).out
    for name in ("a.csv", "t.gpx"):
        command.refused(tmp_path, "join", log, track, "--out", tmp_path / name, words="is also an input")


def imported(shortfalls=(), notices=(), gaps_s=(), vehicle_axes=False):
    taken = [
        Taken("acceleration", "a.csv", "g", 99.6, "x, y, z", "a guess"),
        Taken("speed", "b.csv", "m/s", 0.96, "", ""),
    ]
    return SimpleNamespace(
        app="phyphox", log=SimpleNamespace(t_s=np.linspace(0.0, 12.0, 5)), taken=taken, notices=list(notices),
        shortfalls=list(shortfalls), gaps_s=np.array(gaps_s), rate_hz=99.6, vehicle_axes=vehicle_axes,
    )  # fmt: skip


def test_an_import_is_described_with_its_next_steps(tmp_path, monkeypatch):
    source, out = tmp_path / "x.csv", tmp_path / "out.csv"
    source.write_text("")
    found = [imported()]
    asked = []
    monkeypatch.setattr(ride, "import_recording", lambda *given: asked.append(given) or found[0])
    monkeypatch.setattr(ride, "write_imported", lambda *_: None)
    done = command.works("import", source, "--columns", "t=a", "--units", "a=g", "--from", 1, "--out", out)
    assert asked == [(source, {"t": "a"}, {"a": "g"}, 1.0, None)]
    assert "phyphox" in done.out and "100 Hz" in done.out and "0.96 Hz" in done.out
    assert "acceleration: a guess\n" in done.out and "\nspeed: " not in done.out
    assert f"written: {out}, 5 samples in 12.0 s, 100 per second\n" in done.out
    assert f"next: kickstand calibrate ride {out} --out {tmp_path / 'out.cal.json'}\n" in done.out
    assert "x is left" not in done.out
    found[0] = imported(gaps_s=[1.5], vehicle_axes=True, notices=[Plain("odd")])
    done = command.works("import", source, "--out", out)
    assert asked[-1][1] is None
    assert "100 per second, 1 gap of 1.5 s in all\n" in done.out and "x is left, y up, z forward" in done.out
    assert done.err == f"warning: {source}: odd\n"
    found[0] = imported(gaps_s=[1.0, 2.0], shortfalls=[Plain("too short")])
    done = command.works("import", source, "--out", out)
    assert "2 gaps of 3.0 s in all" in done.out and "next:" not in done.out
    assert done.err == f"warning: {source}: too short\n"
    found[0] = imported(notices=[MirroredAxes()])
    assert "next:" not in command.works("import", source, "--out", out).out
    command.write_cal(tmp_path / "out.cal.json")
    done = command.works("import", source, "--out", out)
    assert f"{tmp_path / 'out.cal.json'} belongs to an earlier ride.\n" in done.out and "next:" not in done.out


@pytest.mark.parametrize("as_json", [True, False])
def test_a_report_has_the_notices_of_its_ride(as_json, log, monkeypatch):
    seen = SimpleNamespace(notices=[Plain("odd")])
    monkeypatch.setattr(ride, "open_ride", lambda *_, **__: "opened")
    monkeypatch.setattr(ride, "overview", lambda *_: seen)
    monkeypatch.setattr(ride, "page", lambda _: "the report")
    monkeypatch.setattr(ride, "as_data", lambda _: {"max_deg": 40})
    done = command.works("report", log, *(["--json"] if as_json else []))
    assert done.out == ('{"max_deg": 40}\n' if as_json else "the report\n")
    assert done.err == f"warning: {log}: odd\n"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (FileNotFoundError(2, "No such file", "x"), "x: No such file: check the name and its directory"),
        (IsADirectoryError(21, "Is a directory", "x"), "x: Is a directory: give the name of a file"),
        (OSError(28, "No space left"), "No space left: check the disk, the file or the connection, then repeat this"),
    ],
)
def test_an_error_of_the_system_has_its_remedy(error, words, tmp_path, monkeypatch):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(main.kickstand, "main", fails)
    assert command.refused(tmp_path, "report") == f"kickstand: {words}\n"


def test_the_site_is_written_to_a_directory_only(tmp_path, monkeypatch):
    monkeypatch.setattr(without_a_board.site, "site_files", lambda: {"index.html": b"home", "a/b.js": b"code"})
    (tmp_path / "file").write_text("")
    command.refused(tmp_path, "web", "--out", tmp_path / "file", words="is a file: give --out the name of a directory")
    done = command.works("web", "--out", tmp_path / "site")
    assert done.out.startswith(f"written: {tmp_path / 'site'}, 2 files for a web server")
    assert (tmp_path / "site" / "a" / "b.js").read_bytes() == b"code"
