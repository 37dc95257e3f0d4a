"""`kickstand overlay` and api.overlay(): pictures read back, times, the drawn part of a ride, and refusals."""

from typing import Any

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.common.messages import InputError
from kickstand_tools.overlay.gauge import Gauge
from kickstand_tools.overlay.overlay import MARGIN, shown
from support import command
from support.recordings import gopro


@pytest.fixture(scope="module")
def lean(ride):
    return shown(api.open_ride(ride, smoothed=True).read())


@pytest.fixture(scope="module")
def left_s(lean) -> float:
    """Return the time of the largest lean to the left, in s. Six seconds later the bike leans to the right."""
    return round(float(lean.t_s[np.nanargmin(lean.lean_deg)]), 2)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    return gopro.film(tmp_path_factory.mktemp("film") / "film.mp4", 3.0)


def filled(pictures: np.ndarray, gauge: Gauge) -> np.ndarray:
    """Return the filled share of the dial in each picture, negative on the left. pictures: the gauge alone."""
    colour = pictures[..., :3].astype(int)
    amber = (colour[..., 0] > 180) & (np.abs(colour[..., 1] - 160) < 60) & (colour[..., 2] < 110)
    dial = amber[:, : round(0.55 * gauge.height), : round(1.15 * gauge.height)]
    middle = round(0.6 * gauge.height)
    sides = dial[:, :, middle:].sum(axis=(1, 2)) - dial[:, :, :middle].sum(axis=(1, 2)).astype(float)
    return sides / max(np.abs(sides).max(), 1.0)


@pytest.mark.parametrize("form", [".mov", pytest.param(".webm", marks=pytest.mark.long)])
def test_transparent_clip_shows_the_lean(tmp_path, ride, lean, left_s, form):
    out = tmp_path / f"clip{form}"
    api.overlay(ride, out, from_s=left_s, to_s=left_s + 8.0, fps=10.0, height=240)
    pictures, gauge = gopro.frames(out, "rgba"), Gauge(240)
    assert pictures.shape == (80, gauge.height, gauge.width, 4)
    assert pictures[:, 0, 0, 3].max() < 10 and pictures[..., 3].max() > 245
    true_deg = lean.at(left_s + np.arange(80) / 10).lean_deg
    assert true_deg.min() < -20.0 < 20.0 < true_deg.max()
    # At the largest roll rate, 3.5 degrees correspond to 0.06 s.
    assert np.abs(filled(pictures, gauge) * np.abs(true_deg).max() - true_deg).max() < 3.5


def test_gauge_over_a_video_shows_the_lean_at_its_time(tmp_path, ride, film, left_s):
    """The gauge is in the lower left corner. The rest of the video and its sound are unchanged."""
    out = tmp_path / "out.mp4"
    offset = "--offset", round(left_s - 2.0, 2)
    printed = command.works("overlay", ride, "--video", film, *offset, "--out", out).out
    assert printed == f"written: {out}, 30 frames, 3.0 s, 10 per second\n"
    pictures, plain = gopro.frames(out), gopro.frames(film)
    assert len(pictures) == pytest.approx(30, abs=1)
    gauge, margin = Gauge(240), round(MARGIN * 240)
    rows, columns = slice(240 - margin - gauge.height, 240 - margin), slice(margin, margin + gauge.width)
    around = np.ones((240, 320), dtype=bool)
    around[rows.start - 8 : rows.stop + 8, : columns.stop + 8] = False
    assert np.abs(pictures[0].astype(int) - plain[0])[around].max() < 12
    assert filled(pictures[:, rows, columns], gauge)[20] < -0.5
    assert b"soun" in out.read_bytes()  # the name of a track of sound in MP4


def test_a_gopros_gyro_finds_the_offset(tmp_path):
    """The camera points elsewhere. The readings of another ride's camera are refused."""
    simulated = api.simulate_ride("street", seed=4, seconds=60.0)
    begin = 5005  # index at 200 Hz; its time is in the middle of a compared cell of 0.05 s
    away = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    rates = simulated.readings[begin : begin + 20 * 200, 4:] @ away + [1.0, -2.0, 0.5]
    log = api.Log.from_readings(simulated.readings, simulated.rate_hz)
    calibration = api.CalibrationFile(vehicle_from_sensor=simulated.vehicle_from_sensor, aligned=True)
    camera = gopro.with_telemetry(gopro.film(tmp_path / "GX01.mp4", 20.0, fps=1), rates, 200.0)
    drawn: dict[str, Any] = {"calibration": calibration, "fps": 1.0, "from_s": 30.0, "to_s": 31.0, "live": True}
    result = api.overlay(log, tmp_path / "out.mp4", video=camera, **drawn)
    assert result.offset_s == pytest.approx(begin / 200.0, abs=0.015) and (result.correlation or 0.0) > 0.9
    other = gopro.with_telemetry(gopro.film(tmp_path / "GX02.mp4", 20.0, fps=1), rates[::-1], 200.0)
    with pytest.raises(InputError, match=r"(turns? like the bike|several times).*: give --offset, the ride's time"):
        api.overlay(log, tmp_path / "out.mp4", video=other, **drawn)


@pytest.mark.parametrize(
    ("seconds", "options", "begin_s", "end_s"),
    [
        (None, {}, 0.0, 100.0),
        (None, {"from_s": 20.0, "to_s": 150.0}, 20.0, 100.0),
        (None, {"from_s": -30.0, "to_s": -10.0}, 70.0, 90.0),
        (None, {"from_s": -300.0}, 0.0, 100.0),
        (60.0, {"offset_s": 12.5}, 12.5, 72.5),
        (60.0, {"offset_s": -1.0}, -1.0, 59.0),
        (60.0, {"offset_s": 41.0}, 41.0, 101.0),
        (60.0, {"offset_s": 12.5, "from_s": 5.0}, 12.5, 72.5),
        (60.0, {"offset_s": 12.5, "from_s": 20.0, "to_s": 30.0}, 20.0, 30.0),
        (60.0, {"offset_s": -20.0, "to_s": 90.0}, 0.0, 40.0),
        (60.0, {"offset_s": 60.0, "from_s": 70.0}, 70.0, 100.0),
    ],
)
def test_the_drawn_part_of_a_ride(ffmpeg, tmp_path, parked, seconds, options, begin_s, end_s):
    log, calibration = parked
    video = ffmpeg.film(10 * seconds) if seconds else None
    calls: list[tuple[int, int]] = []
    result = api.overlay(
        *(log, tmp_path / ("o.mp4" if video else "o.mov"), calibration, video),
        **({"fps": 0.5, "live": True, "progress": lambda *of: calls.append(of)} | options),
    )
    assert (result.begin_s, result.end_s) == pytest.approx((begin_s, end_s))
    assert (result.pictures, result.fps) == (round((end_s - begin_s) / 2.0), 0.5)
    assert result.offset_s == options.get("offset_s") and result.correlation is None
    assert calls[-result.pictures] == (1, result.pictures) and calls[-1] == (result.pictures, result.pictures)


@pytest.mark.parametrize(
    ("seconds", "options", "words"),
    [
        (60.0, {"offset_s": 100.0}, "they have nothing in common"),
        (60.0, {"offset_s": -60.0}, "they have nothing in common"),
        (60.0, {"offset_s": 99.5}, r"with --from 99\.5 --to 100\.0"),
        (60.0, {"offset_s": -1.1}, r"from -1\.1 to 58\.9 s of the ride RIDE, .* with --from 0\.0 --to 58\.9"),
        (60.0, {"offset_s": 41.1}, r"with --from 41\.1 --to 100\.0"),
        (None, {"from_s": 30.0, "to_s": 30.0}, "nothing from"),
        (None, {"from_s": 100.0, "to_s": 110.0}, r"RIDE lasts 100\.0 s: there is nothing from 100\.0 to"),
        (60.0, {}, r"film\.mp4: it has no gyro readings of a GoPro.*: give --offset"),
    ],
)
def test_a_part_outside_the_ride_is_refused(ffmpeg, tmp_path, parked, seconds, options, words):
    log, calibration = parked
    video = ffmpeg.film(10 * seconds) if seconds else None
    out = tmp_path / ("o.mp4" if video else "o.mov")
    with pytest.raises(InputError, match=words):
        api.overlay(log, out, calibration, video, live=True, **options)
    assert not out.exists()


@pytest.mark.parametrize(
    ("out", "options", "words"),
    [
        ("a.mp4", [], "ends in .mov or .webm; an .mp4 needs --video"),
        ("a.mov", ["--offset", 3], "an offset needs a video"),
        ("a.mov", ["--video", "film.mp4"], "over a video the name must end in .mp4"),
        ("a.mp4", ["--video", "film.mp4", "--height", 720], "over a video the gauge follows the video's height"),
    ],
)
def test_names_and_options_that_do_not_fit_are_refused(ffmpeg, tmp_path, ride, monkeypatch, out, options, words):
    ffmpeg.film(30).rename(tmp_path / "film.mp4")
    monkeypatch.chdir(tmp_path)
    command.refused(tmp_path / "film.mp4", "overlay", ride, "--out", out, *options, words=words)


def test_file_that_is_not_a_video_is_refused(tmp_path, ride, film):
    (tmp_path / "text.mp4").write_text("no film\n" * 100)
    (tmp_path / "half.mp4").write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    for name in ("text.mp4", "half.mp4"):
        arguments = "--video", tmp_path / name, "--offset", 1, "--out", tmp_path / "out.mp4"
        command.refused(tmp_path, "overlay", ride, *arguments, words="is not a video that ffmpeg can read")
