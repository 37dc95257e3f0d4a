"""`kickstand overlay`: the tests read back the pictures and check transparency, times, sides and refused videos."""

import os
import subprocess
from typing import Any

import numpy as np
import pytest
from kickstand_tools import api
from support import command
from support.recordings import analysis_rides

pytest.importorskip("imageio_ffmpeg")
pytest.importorskip("PIL")

import imageio_ffmpeg
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.gpmf import telemetry
from kickstand_tools.overlay.overlay import MARGIN
from kickstand_tools.overlay.shown import shown
from kickstand_tools.overlay.video import open_video
from support.recordings import gopro


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=100, speed_hz=1)


@pytest.fixture(scope="module")
def lean(ride):
    return shown(api.open_ride(ride, smoothed=True))


@pytest.fixture(scope="module")
def left_s(lean) -> float:
    """Return the time of the largest lean to the left, in s. Six seconds later the bike leans to the right."""
    return float(lean.t_s[np.nanargmin(lean.lean_deg)])


def filled(pictures: np.ndarray, gauge: Gauge) -> np.ndarray:
    """Return the filled share of the dial in each picture, negative on the left. pictures: the gauge alone."""
    colour = pictures[..., :3].astype(int)
    amber = (colour[..., 0] > 180) & (np.abs(colour[..., 1] - 160) < 60) & (colour[..., 2] < 110)
    dial = amber[:, : round(0.55 * gauge.height), : round(1.15 * gauge.height)]
    middle = round(0.6 * gauge.height)
    sides = dial[:, :, middle:].sum(axis=(1, 2)) - dial[:, :, :middle].sum(axis=(1, 2)).astype(float)
    return sides / max(np.abs(sides).max(), 1.0)


@pytest.mark.parametrize(("form", "fps"), [(".mov", 60), (".webm", 30)])
def test_transparent_clip_shows_the_lean(tmp_path, ride, lean, left_s, form, fps):
    out = tmp_path / f"clip{form}"
    begin = round(left_s, 2)
    arguments = "--from", begin, "--to", begin + 8.0, "--fps", fps, "--height", 240
    said = command.works("overlay", ride, *arguments, "--out", out).out
    assert said == f"written: {out}, {8 * fps} frames, 8.0 s, {fps} per second\n"
    pictures = gopro.frames(out, "rgba")
    gauge = Gauge(240)
    assert pictures.shape == (8 * fps, gauge.height, gauge.width, 4)
    assert pictures[:, 0, 0, 3].max() < 10
    assert pictures[..., 3].max() > 245
    shares = filled(pictures, gauge)
    wanted = lean.at(begin + np.arange(8 * fps) / fps).lean_deg
    assert wanted.min() < -20.0 < 20.0 < wanted.max()
    # At the largest roll rate, 3.5 degrees correspond to 0.06 s.
    assert np.abs(shares * np.abs(wanted).max() - wanted).max() < 3.5


def test_gauge_over_a_video_shows_the_lean_at_its_time(tmp_path, ride, left_s):
    """The video around the gauge is unchanged. The option --offset selects the ride's time that the gauge shows."""
    film, out = gopro.film(tmp_path / "film.mp4", 4.0), tmp_path / "out.mp4"
    offset = round(left_s - 2.0, 2)
    said = command.works("overlay", ride, "--video", film, "--offset", offset, "--fps", 30, "--out", out).out
    assert "120 frames, 4.0 s, 30 per second" in said
    pictures, before = gopro.frames(out), gopro.frames(film)
    assert len(pictures) == pytest.approx(120, abs=1)
    gauge, margin = Gauge(240), round(MARGIN * 240)
    rows, columns = slice(240 - margin - gauge.height, 240 - margin), slice(margin, margin + gauge.width)
    around = np.ones((240, 320), dtype=bool)
    around[rows.start - 8 : rows.stop + 8, : columns.stop + 8] = False
    assert np.abs(pictures[0].astype(int) - before[0])[around].max() < 12
    at_left = filled(pictures[:, rows, columns], gauge)[60]
    assert at_left < -0.5
    assert "Audio" in ffmpeg("-i", out)


def ffmpeg(*arguments: object) -> str:
    """Run ffmpeg and return its output."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True).stderr


def test_video_that_began_before_the_ride_is_cut(tmp_path, ride):
    film = gopro.film(tmp_path / "film.mp4", 6.0)
    given = "overlay", ride, "--video", film, "--offset", -3
    out = "--out", tmp_path / "out.mp4"
    said = command.refused(tmp_path, *given, *out, words="lasts from -3.0 to 3.0 s of the ride")
    assert "--from 0.0 --to 3.0" in said
    for part in (("--to", 3), ("--from", 0)):
        command.works(*given, *part, *out)
        assert len(gopro.frames(tmp_path / "out.mp4")) == pytest.approx(30, abs=1), part


def test_a_gopros_gyro_finds_the_offset(tmp_path):
    made = api.simulate_ride("street", seed=4, seconds=120.0)
    log = tmp_path / "RIDE.csv"
    api.write_log(log, api.Log.from_readings(made.readings, made.rate_hz))
    kickstand, upright = (api.Log.from_readings(pose, made.rate_hz) for pose in (made.kickstand, made.upright))
    api.write_calibration(tmp_path / "RIDE.cal.json", api.fit_two_positions(kickstand, upright).calibration)
    begin = 9005  # index at 200 Hz; its time is in the middle of a compared cell of 0.05 s
    turned = made.readings[begin : begin + 30 * 200, 4:] @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    noise = np.random.default_rng(2).normal(0.0, 0.5, turned.shape)
    film = gopro.with_telemetry(gopro.film(tmp_path / "GX01.mp4", 30.0), turned + noise + [1.0, -2.0, 0.5], 200.0)
    more = "--from", 50, "--to", 52, "--out", tmp_path / "out.mp4"
    said = command.works("overlay", log, "--video", film, *more).out
    found = float(said.partition("--offset ")[2].split()[0])
    assert found == pytest.approx(begin / 200.0, abs=0.015)
    other = gopro.with_telemetry(gopro.film(tmp_path / "GX02.mp4", 30.0), walk(30 * 200), 200.0)
    given = "overlay", log, "--video", other, "--out", tmp_path / "2.mp4"
    said = command.refused(tmp_path, *given, words="give --offset")
    assert "turn like the bike" in said or "several times" in said


def walk(count: int) -> np.ndarray:
    """Return the rates of a random motion, in deg/s, shape (count, 3)."""
    steps = np.random.default_rng(5).normal(size=(count, 3))
    return 40.0 * np.apply_along_axis(lambda v: np.convolve(v, np.ones(80) / 80.0, "same"), 0, steps)


def test_file_that_is_not_a_video_of_the_ride_is_refused(tmp_path, ride):
    film = gopro.film(tmp_path / "film.mp4", 3.0)
    (tmp_path / "text.mp4").write_text("no film\n" * 100)
    (tmp_path / "half.mp4").write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    sound = tmp_path / "sound.mp4"
    gopro.film(tmp_path / "loud.mp4", 1.0)
    ffmpeg("-i", tmp_path / "loud.mp4", "-vn", "-c", "copy", sound)
    out = "--out", tmp_path / "out.mp4"
    for video, more, words in (
        ("text.mp4", ("--offset", 1), "is not a video that ffmpeg can read"),
        ("half.mp4", ("--offset", 1), "is not a video that ffmpeg can read"),
        ("sound.mp4", ("--offset", 1), "has no pictures"),
        ("no.mp4", ("--offset", 1), "there is no such file"),
        ("film.mp4", (), "it has no gyro readings of a GoPro"),
        ("film.mp4", ("--offset", 500), "they have nothing in common"),
        ("film.mp4", ("--offset", -50), "they have nothing in common"),
        ("film.mp4", ("--offset", 5, "--from", 20), "there is nothing from 20.0 to 8.0 s"),
    ):
        command.refused(tmp_path, "overlay", ride, "--video", tmp_path / video, *more, *out, words=words)
    clip = "--out", tmp_path / "clip.mov"
    command.refused(tmp_path, "overlay", ride, "--video", film, "--offset", 1, *clip, words="must end in .mp4")
    given = "overlay", ride, "--video", film, "--offset", 1
    command.refused(tmp_path, *given, "--height", 480, *out, words="over a video the gauge follows the video's height")
    command.refused(tmp_path, "overlay", ride, *out, words="ends in .mov or .webm")
    command.refused(tmp_path, "overlay", ride, "--offset", 3, *clip, words="an offset needs a video")
    command.refused(tmp_path, "overlay", ride, "--video", film, "--offset", 1, "--out", film, words="is also an input")


def test_stopped_overlay_leaves_nothing(tmp_path, ride):
    """No file remains, and ffmpeg does not keep running."""
    film = gopro.film(tmp_path / "film.mp4", 5.0)
    (tmp_path / "clip.mov").write_text("an older clip")
    before = command.snapshot(tmp_path)
    seen = []

    def stop(done: int, total: int) -> None:
        seen.append((done, total))
        if total == 50 and done == 20:
            raise KeyboardInterrupt

    over: dict[str, Any] = {"video": film, "offset_s": 1.0}
    clip: dict[str, Any] = {"from_s": 0.0, "to_s": 5.0, "fps": 10.0}
    for name, more in (("out.mp4", over), ("clip.mov", clip)):
        with pytest.raises(KeyboardInterrupt):
            api.overlay(ride, tmp_path / name, progress=stop, **more)
        assert (20, 50) in seen
        seen.clear()
    assert command.snapshot(tmp_path) == before
    assert not [line for line in os.popen("ps -o ppid=,comm=").read().splitlines() if f"{os.getpid()} ffmpeg" in line]


def test_full_disk_is_reported_by_overlay(tmp_path, ride, monkeypatch):
    """The message contains the last line of ffmpeg's output."""
    from kickstand_tools.overlay import overlay

    monkeypatch.setitem(overlay._TRANSPARENT, ".mov", ("-c:v", "no-such-codec"))
    given = "overlay", ride, "--from", 1, "--to", 2, "--out", tmp_path / "clip.mov"
    command.refused(tmp_path, *given, words="ffmpeg has stopped: ")


def test_gopro_readings_are_in_deg_s_on_the_videos_time(tmp_path):
    rate = walk(3 * 150)
    film = open_video(gopro.with_telemetry(gopro.film(tmp_path / "GX.mp4", 3.0), rate, 150.0))
    assert (film.width, film.height, film.fps, film.seconds) == (320, 240, 10.0, pytest.approx(3.0))
    read = telemetry(film)
    assert read is not None
    assert np.allclose(read.rate_dps, rate, atol=0.02)
    assert np.allclose(read.t_s, (np.arange(450) + 0.5) / 150.0, atol=0.002)
    assert telemetry(open_video(gopro.film(tmp_path / "plain.mp4", 1.0))) is None


def test_live_option_shows_the_displayed_lean(tmp_path, ride):
    """The displayed lean and the smoothed lean differ at the beginning. Only smoothing uses later readings."""
    for more in ((), ("--live",)):
        part = "--from", 6, "--to", 9, "--height", 240
        command.works("overlay", ride, *part, *more, "--out", tmp_path / f"clip{len(more)}.webm")
    smoothed, live = (gopro.frames(tmp_path / f"clip{k}.webm").astype(int) for k in (0, 1))
    assert np.abs(smoothed - live).max() > 100
