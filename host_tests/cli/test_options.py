"""The limits and defaults of options, and the commands that simulate. The computations are replaced."""

import errno
import os
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.cli import calibrate, main, ride, simulated, without_a_board
from kickstand_tools.common import plugins
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.messages import Plain
from kickstand_tools.demo.demo import DeviceStopped
from support import command


@pytest.fixture
def rides(monkeypatch):
    """Replace the simulation of a ride. Return the arguments of each call."""
    made = SimpleNamespace(time=np.zeros(321), truth={"lean_deg": np.array([-12.34, 0.0, 5.0])}, stand_deg=-11.96)
    calls = []
    monkeypatch.setattr(simulated, "simulate", lambda *given, **named: calls.append((given, named)) or made)
    return calls


def test_a_simulated_ride_is_described_with_its_lean(rides, tmp_path):
    done = command.works("simulate", "--profile", "street", "--out", tmp_path)
    assert done.out.splitlines() == [
        f"written: {tmp_path / 'RIDE.csv'}, 321 samples, with its poses and TRUTH.csv",
        "lean, > 0 to the right: -12.0 degrees in KICKSTAND.csv; RIDE.csv begins at -12.3",
    ]
    ((given, named),) = rides
    assert given == ("street", 0, tmp_path)
    assert named == {
        "seconds": 640.0,
        "upright_error_deg": 0.0,
        "pitch_change_deg": None,
        "road": None,
        "mount": None,
        "dive": None,
        "speed": False,
    }
    command.works("simulate", "--profile", "street", "--seed", 3, "--speed", "--dive", 3, 1.5, "--out", tmp_path)
    given, named = rides[1]
    assert given[1] == 3 and named["speed"] is True and named["dive"] == (3.0, 1.5)


@pytest.mark.parametrize(
    ("option", "least", "most"),
    [
        ("--seconds", 20.0, 7200.0),
        ("--upright-error", -30.0, 30.0),
        ("--pitch-change", -10.0, 10.0),
        ("--seed", 0, None),
    ],
)
def test_options_of_a_simulated_ride_have_limits(rides, tmp_path, option, least, most):
    given = "simulate", "--profile", "street", "--out", tmp_path
    for value in (least, most):
        if value is not None:
            command.works(*given, option, value)
    count = len(rides)
    for value in (least - 1, None if most is None else most + 0.1):
        if value is not None:
            command.refused(tmp_path, *given, option, value, words="is not in the range")
    assert len(rides) == count


@pytest.mark.parametrize(("dive", "fits"), [((-2, 8), True), ((8, -2), True), ((-2.1, 0), False), ((0, 8.1), False)])
def test_a_dive_has_limits_for_braking_and_for_accelerating(rides, tmp_path, dive, fits):
    done = command.run("simulate", "--profile", "street", "--out", tmp_path, "--dive", *dive)
    assert (done.status == 0) is fits and len(rides) == fits


def test_a_simulation_needs_a_profile_or_a_fleet(rides, tmp_path):
    command.refused(tmp_path, "simulate", "--out", tmp_path, words="Missing option '--profile', or '--fleet'")
    command.refused(tmp_path, "simulate", "--fleet", 0, "--out", tmp_path, words="is not in the range x>=1")


def test_a_simulated_fleet_is_counted(rides, tmp_path, monkeypatch):
    calls = []

    def fleet(*given, progress):
        calls.append(given)
        progress(1, 2)
        return [SimpleNamespace(paths=["a", "b"]), SimpleNamespace(paths=["c"])]

    monkeypatch.setattr(plugins, "part", lambda group, name: fleet)
    done = command.works("simulate", "--fleet", 2, "--seed", 5, "--out", tmp_path)
    assert done.out == f"written: {tmp_path}/MANIFEST.csv and TRUTH.csv, 2 vehicles, 3 logs\n"
    assert calls == [(tmp_path, 2, 5)] and rides == []


@pytest.mark.parametrize(("height", "fits"), [(240, True), (4320, True), (239, False), (4321, False)])
def test_an_overlay_has_a_height_in_pixels(height, fits, tmp_path, monkeypatch):
    made = SimpleNamespace(notices=[], correlation=None, pictures=1, begin_s=0.0, end_s=1.0, fps=30.0)
    asked = []
    monkeypatch.setattr(ride, "overlay", lambda *_, **named: asked.append(named) or made)
    command.write_cal(tmp_path / "a.cal.json")
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)
    done = command.run("overlay", log, "--height", height, "--out", tmp_path / "o.mov")
    assert (done.status == 0) is fits
    if fits:
        (named,) = asked
        assert (named["height"], named["fps"], named["mph"], named["offset_s"]) == (height, None, False, None)
        assert (named["from_s"], named["to_s"], named["live"]) == (None, None, False)


def test_an_overlay_never_overwrites_its_video(tmp_path):
    command.write_cal(tmp_path / "a.cal.json")
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)
    video = tmp_path / "v.mp4"
    video.write_text("")
    for out in (video, log):
        command.refused(tmp_path, "overlay", log, "--video", video, "--out", out, words="is also an input")


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["demo"], {"hand": False, "cpython": False, "display": "lcd"}),
        (["demo", "--hand", "--cpython"], {"hand": True, "cpython": True, "display": "lcd"}),
        (["try", "my.py", "--display", "sh1106"], {"hand": False, "cpython": False, "display": "sh1106"}),
    ],
)
def test_the_demo_gets_its_options(given, expected, monkeypatch):
    asked = []
    monkeypatch.setattr(without_a_board, "demo", lambda **chosen: asked.append(chosen))
    command.works(*given)
    assert asked == [expected | ({"user": Path("my.py")} if given[0] == "try" else {})]


def test_a_device_that_stopped_is_status_1(monkeypatch):
    def stopped(**_):
        raise DeviceStopped("its last words")

    monkeypatch.setattr(without_a_board, "demo", stopped)
    done = command.run("demo")
    assert (done.status, done.out, done.err) == (1, "", "its last words\n")


def test_the_pages_are_served_until_ctrl_c(monkeypatch):
    opened = []

    class Server:
        server_address = ("127.0.0.1", 8399)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            opened.append("closed")

        def serve_forever(self):
            raise KeyboardInterrupt

    monkeypatch.setattr(without_a_board.site, "site_files", lambda: {"index.html": b""})
    monkeypatch.setattr(without_a_board.serve, "server", lambda files: Server())
    monkeypatch.setattr(without_a_board.webbrowser, "open", opened.append)
    done = command.works("web")
    assert done.out == "Kickstand in the browser: http://127.0.0.1:8399/ (press Ctrl-C to stop)\n"
    assert opened == ["http://127.0.0.1:8399/", "closed"]


def test_plot_names_each_file(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(ride.plot, "check", lambda out: asked.append(out))
    monkeypatch.setattr(ride.plot, "draw", lambda seen, out, tiles: asked.append(tiles) or [out / "a", out / "b"])
    monkeypatch.setattr(ride, "open_ride", lambda *given, **named: asked.append(named) or "opened")
    monkeypatch.setattr(ride, "overview", lambda *_: SimpleNamespace(notices=[]))
    command.write_cal(tmp_path / "a.cal.json")
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)
    done = command.works("plot", log, "--out", tmp_path)
    assert done.out == f"written: {tmp_path / 'a'}\nwritten: {tmp_path / 'b'}\n"
    command.works("plot", log, "--out", tmp_path, "--tiles", "--live")
    assert asked == [tmp_path, {"smoothed": True}, False, tmp_path, {"smoothed": False}, True]


def test_a_cut_says_how_long_it_is(tmp_path, monkeypatch):
    asked = []

    def cut(*given):
        asked.append(given[2:4])
        given[-1].append(Plain("a gap"))
        return 250, 2.46

    monkeypatch.setattr(ride, "cut_log", cut)
    log = command.still(tmp_path / "a.csv", (0, 1, 0), seconds=1.0)
    out = tmp_path / "b.csv"
    for given, expected in ((("--from", "1:00"), (60.0, None)), (("--to", "-5"), (None, -5.0))):
        done = command.works("cut", log, *given, "--out", out)
        assert done.out == f"written: {out}, 250 samples, 2.5 s\n" and done.err == f"warning: {log}: a gap\n"
        assert asked[-1] == expected


def test_an_import_with_a_calibration_names_its_samples(tmp_path, monkeypatch):
    """The line is on standard error, because standard output may be JSON."""
    source = tmp_path / "x.csv"
    source.write_text("not a log")
    found = SimpleNamespace(app="phyphox", log="the log", rate_hz=99.6, notices=[Plain("odd")])
    found.log = SimpleNamespace(t_s=np.zeros(5))
    monkeypatch.setattr(ride, "import_of_app", lambda _: found)
    monkeypatch.setattr(ride, "read_calibration", lambda _: CalibrationFile(aligned=True))
    monkeypatch.setattr(ride, "smooth_to_csv", lambda *_: (5, []))
    done = command.works("smooth", source, "--calibration", "CAL.json", "--out", tmp_path / "o.csv")
    assert done.err.splitlines() == [
        f"{source}: imported from phyphox, 5 samples, 100 per second",
        f"warning: {source}: odd",
    ]
    command.refused(tmp_path, "smooth", source, "--out", source, words="is also an input")


def test_a_folder_is_an_input_with_all_its_files(tmp_path):
    folder = tmp_path / "export"
    folder.mkdir()
    (folder / "b.csv").write_text("")
    command.refused(tmp_path, "import", folder, "--out", folder / "b.csv", words="b.csv is also an input")


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (InputError("no\nsuch   thing"), 2, "no such thing"),
        (MemoryError(), 2, "not enough memory"),
        (RecursionError(), 2, "nested too deeply"),
        (UnicodeError("bad"), 2, "characters that cannot be used here (bad): rename the file"),
        (NotADirectoryError(errno.ENOTDIR, "Not a directory", "x"), 2, "check the name and its directory"),
        (FileNotFoundError(errno.ENOENT, "No such file"), 2, "check the disk, the file or the connection"),
        (IsADirectoryError(errno.EISDIR, "Is a directory"), 2, "check the disk, the file or the connection"),
        (KeyboardInterrupt(), 130, "stopped"),
        (ZeroDivisionError("oh"), 2, "unexpected ZeroDivisionError: oh: a fault in kickstand, please report it"),
    ],
)
def test_each_error_is_one_line_with_its_status(error, status, words, monkeypatch):
    def fails(*_, **__):
        raise error

    monkeypatch.setitem(main.COMMANDS, "check", (".board", ""))
    monkeypatch.setattr("kickstand_tools.cli.board.check", fails)
    done = command.run("check")
    (line,) = done.err.strip().splitlines()
    assert done.status == status and words in line


@pytest.mark.skipif(os.name == "nt", reason="Windows has other signals")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_ends_a_command_with_its_number(name, monkeypatch):
    number = getattr(signal, name)
    before = signal.getsignal(number)
    monkeypatch.setattr("kickstand_tools.cli.board.check", lambda *_: os.kill(os.getpid(), number))
    signal.signal(number, signal.SIG_DFL)
    try:
        done = command.run("check")
        assert (done.status, done.err) == (128 + number, "kickstand: stopped\n")
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_without_a_command_the_help_lists_all_commands():
    for given in ((), ("--help",), ("-h",)):
        said = command.works(*given).out
        assert all(f"  {name} " in said for name in main.COMMANDS) and "Lean meter for any motorcycle" in said
        lines = [line.split()[0] for line in said.partition("Commands:")[2].splitlines() if line.startswith("  ")]
        names = [name for name in lines if name in main.COMMANDS]
        assert names == sorted(main.COMMANDS)
    assert "version" in command.works("--version").out


def test_each_command_shows_its_defaults_and_its_first_line():
    for name, (_, words) in main.COMMANDS.items():
        done = CliRunner().invoke(main.kickstand, [name, "--help"])
        assert done.exit_code == 0 and "Usage:" in done.output and words
    assert "[default: 640.0; 20.0<=x<=7200.0]" in " ".join(command.works("simulate", "--help").out.split())


def test_two_poses_have_the_kickstand_on_the_left_unless_told(tmp_path, monkeypatch):
    asked = []

    def fit(_kickstand, _upright, before, side):
        asked.append((before, side))
        raise InputError("enough")

    monkeypatch.setattr(calibrate, "fit_two_positions", fit)
    given = [command.still(tmp_path / name, (0, 1, 0), seconds=1.0) for name in ("k.csv", "u.csv")]
    command.refused(tmp_path, "calibrate", "two", *given, "--out", tmp_path / "c.json", words="enough")
    command.refused(tmp_path, "calibrate", "two", *given, "--side", "right", "--out", tmp_path / "c.json")
    assert asked == [(None, "left"), (None, "right")]
