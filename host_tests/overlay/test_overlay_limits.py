"""The values that a gauge gets, and the part of the ride that is drawn."""

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("PIL")
from kickstand_tools.common.errors import InputError
from kickstand_tools.overlay import overlay, shown, video
from kickstand_tools.overlay.shown import Shown

NAN = math.nan


FILM = video.Video(Path("a.mp4"), 1920, 1080, 30.0, 60.0, None)


# shown.py


def seen(t_s, lean=None, speed=None) -> Shown:
    t_s = np.array(t_s, dtype=float)
    lean, speed = (np.full(len(t_s), NAN) if of is None else np.array(of, dtype=float) for of in (lean, speed))
    return Shown(
        t_s, lean, lean, lean, speed, np.linspace(1.0, len(t_s), len(t_s)), np.linspace(11.0, len(t_s) + 10.0, len(t_s))
    )


def test_a_lean_is_shown_up_to_a_gap_of_200_ms():
    values = seen([0.0, 0.2, 0.41, 0.5], [0.0, 2.0, 4.0, 5.0]).at(np.array([-0.09, 0.1, 0.3, 0.5, 0.54, 0.56]))
    assert values.lean_deg == pytest.approx([-0.9, 1.0, NAN, 5.0, 5.0 + 4 / 9, NAN], nan_ok=True)
    assert values.left_deg.tolist() == [0.0, 1.0, 2.0, 4.0, 4.0, 4.0]
    assert np.isnan(seen([0.0, 0.2], [0.0, 2.0]).at(np.array([-0.11])).lean_deg).all()


def test_a_speed_is_shown_up_to_3_s_apart():
    t_s = np.arange(0.0, 8.0, 0.5)
    speed = np.full(16, NAN)
    speed[[0, 6, 13]] = 10.0, 16.0, 20.0  # speeds at 0, 3 and 6.5 s
    values = seen(t_s, None, speed).at(np.array([0.0, 1.5, 3.0, 5.0]))
    assert values.speed_mps == pytest.approx([10.0, 13.0, NAN, NAN], nan_ok=True)
    speed[3:] = NAN
    assert np.isnan(seen(t_s, None, speed).at(t_s).speed_mps).all() and seen(t_s, None, speed).has_speed
    assert not seen(t_s).has_speed


def test_forces_are_means_and_only_trusted_leans_are_shown():
    t_s = np.arange(200) / 100.0
    block = SimpleNamespace(
        t_s=t_s, trusted=t_s >= 1.0, lean_deg=np.full(200, 8.0), forward_g=(t_s >= 1.0) * 0.6,
        lateral_g=(t_s >= 1.0) * -0.3, speed_mps=t_s,
    )  # fmt: skip
    ride: Any = SimpleNamespace(blocks=lambda progress, notices: [block])
    found = shown.shown(ride)
    assert np.isnan(found.lean_deg[:100]).all() and found.lean_deg[100] == 8.0
    assert found.right_deg[[99, 114, 115, 199]].tolist() == [0.0, 0.0, 8.0, 8.0] and not found.left_deg.any()
    assert found.forward_g[[80, 120]] == pytest.approx([0.0, 0.6]) and 0.0 < found.forward_g[95] < 0.3
    assert found.forward_g[100] == pytest.approx(0.3, abs=0.02) and found.left_g[150] == pytest.approx(-0.3)


# overlay.py


def part(offset=None, begin=None, end=None, seconds=60.0, film=True):
    of = video.Video(Path("a.mp4"), 8, 8, 30.0, seconds, None) if film else None
    ride: Any = SimpleNamespace(t_s=np.array([0.0, 100.0]))
    return overlay._part(ride, of, offset, begin, end, "RIDE")


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"film": False}, (0.0, 100.0)),
        ({"film": False, "begin": 20.0, "end": 150.0}, (20.0, 100.0)),
        ({"film": False, "begin": -30.0, "end": -10.0}, (70.0, 90.0)),
        ({"film": False, "begin": -300.0}, (0.0, 100.0)),
        ({"offset": 12.5}, (12.5, 72.5)),
        ({"offset": -1.0}, (-1.0, 59.0)),
        ({"offset": 41.0}, (41.0, 101.0)),
        ({"offset": 12.5, "begin": 5.0}, (12.5, 72.5)),
        ({"offset": 12.5, "begin": 20.0, "end": 30.0}, (20.0, 30.0)),
        ({"offset": -20.0, "end": 90.0}, (0.0, 40.0)),
        ({"offset": 60.0, "begin": 70.0}, (70.0, 100.0)),
    ],
)
def test_the_drawn_part_of_a_ride(given, found):
    assert part(**given) == pytest.approx(found)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"offset": 100.0}, "they have nothing in common"),
        ({"offset": -60.0}, "they have nothing in common"),
        ({"offset": -59.5}, r"with --from 0\.0 --to 0\.5"),
        ({"offset": 99.5}, r"with --from 99\.5 --to 100\.0"),
        ({"offset": -1.1}, r"from -1\.1 to 58\.9 s of .* with --from 0\.0 --to 58\.9"),
        ({"offset": 41.1}, r"with --from 41\.1 --to 100\.0"),
        ({"film": False, "begin": 30.0, "end": 30.0}, "nothing from"),
        ({"film": False, "begin": 100.0, "end": 110.0}, r"RIDE lasts 100\.0 s: there is nothing from 100\.0 to"),
    ],
)
def test_a_part_outside_the_ride_is_refused(given, words):
    with pytest.raises(InputError, match=words):
        part(**given)


def test_the_gauge_is_in_the_lower_left_corner():
    made = overlay._laid_over(FILM, 2.5, 7.25, 25.0, ["GAUGE"], 32)
    assert made[:4] == ["-ss", "2.5000", "-t", "7.2500"] and "GAUGE" in made
    assert "overlay=x=32:y=main_h-overlay_h-32:eof_action=repeat[all]" in made[made.index("-filter_complex") + 1]
    assert ",fps=25[film]" in made[made.index("-filter_complex") + 1]
    plain = overlay._laid_over(FILM, -0.5, 1.0, None, [], 1)
    assert plain[1] == "0.0000" and "fps" not in plain[plain.index("-filter_complex") + 1]
    at = plain.index("0:a?")
    assert plain[plain.index("-crf") + 1] == "18" and plain[at - 3 : at] == ["-map", "[all]", "-map"]
    assert plain[at + 1 : at + 3] == ["-c:a", "copy"]


def overlaid(monkeypatch, film=None, **given):
    """Return the Overlaid, ffmpeg's arguments, the number of pictures, and the gauge's arguments."""
    calls: list = []
    ride = seen(np.arange(0.0, 10.0, 0.1), np.arange(100.0), np.ones(100))
    monkeypatch.setattr(overlay, "_check", lambda *_: film)
    monkeypatch.setattr(overlay, "read_twice", lambda source: source)
    monkeypatch.setattr(
        overlay, "open_ride", lambda *_, smoothed: calls.append(smoothed) or SimpleNamespace(name="R", log=1)
    )
    monkeypatch.setattr(overlay, "shown", lambda *_: ride)

    class Drawn:
        def __init__(self, height, has_speed, mph):
            calls.append((height, has_speed, mph))
            self.width, self.height = 50, 30

        def picture(self, *values):
            calls.append(values)
            return SimpleNamespace(tobytes=lambda: b"x")

    monkeypatch.setattr("kickstand_tools.overlay.gauge.Gauge", Drawn)

    def write(path, arguments, pictures, each):
        calls.append(arguments)
        for _ in pictures:
            each()

    monkeypatch.setattr(overlay, "write_video", write)
    return overlay.overlay("r", given.pop("out"), **given), calls


def test_a_clip_has_30_pictures_a_second(monkeypatch, tmp_path):
    done: list = []
    found, calls = overlaid(
        monkeypatch, out=tmp_path / "a.mov", from_s=2.0, to_s=4.0, progress=lambda *of: done.append(of), live=True
    )
    assert (found.pictures, found.fps, found.begin_s, found.end_s, found.offset_s) == (60, 30.0, 2.0, 4.0, None)
    assert calls[0] is False and calls[1] == (1080, True, False)
    assert calls[2][:10] == ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", "50x30", "-r", "30", "-i", "-"]
    assert calls[3][0] == pytest.approx(20.0) and calls[4][0] == pytest.approx(20.0 + 10.0 / 30.0)
    assert done[0] == (1, 60) and done[-1] == (60, 60) and len(done) == 60
    found, calls = overlaid(monkeypatch, out=tmp_path / "a.webm", fps=10.0, height=720, mph=True, from_s=9.895)
    assert found.pictures == 1 and calls[0] is True and calls[1] == (720, True, True)


def test_over_a_video_the_gauge_follows_its_smaller_side(monkeypatch, tmp_path):
    film = video.Video(Path("a.mp4"), 700, 1000, 25.0, 4.0, None)
    found, calls = overlaid(monkeypatch, film, out=tmp_path / "a.mp4", offset_s=3.0)
    assert found.pictures == 100 and calls[1][0] == 700 and found.offset_s == 3.0
    assert "overlay=x=21:y" in " ".join(calls[2]) and calls[2][:4] == ["-ss", "0.0000", "-t", "4.0000"]
    monkeypatch.setattr(overlay, "_found_offset", lambda *_: (5.0, 0.9))
    found, calls = overlaid(monkeypatch, film, out=tmp_path / "a.mp4", from_s=6.0, to_s=7.0)
    assert (found.offset_s, found.correlation, found.begin_s) == (5.0, 0.9, 6.0)
    assert calls[2][:4] == ["-ss", "1.0000", "-t", "1.0000"]
