"""Rides for the overlay, and a program that replaces ffmpeg: it prints what a test wants, and writes nothing else."""

import os
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools import api
from support.recordings import analysis_rides

pytest.importorskip("imageio_ffmpeg")
pytest.importorskip("PIL")

HEAD = "Input #0, mov\n  Stream #0:0[0x1](und): Video: h264, yuv420p, {size}, 9 kb/s, {rate}\n"
# imageio-ffmpeg starts this program instead of ffmpeg. It answers like ffmpeg: it describes a video, counts the
# pictures, lists packets, copies their data, or takes pictures from its standard input.
PROGRAM = """#!/bin/sh
cd "{folder}"
echo "$@" >> calls
case "$*" in
*"-f null"*) cat counted >&2; exit $(cat status) ;;
*"-f framecrc"*) cat listed ;;
*"-f data"*) cat packets ;;
*"-f rawvideo"*) echo $$ > id; [ -e deaf ] || cat > pictures; cat words >&2; exit $(cat status) ;;
*) cat described >&2; exit 1 ;;
esac
"""


class Ffmpeg:
    """The program that replaces ffmpeg. answers() sets what it prints."""

    def __init__(self, folder: Path):
        self.folder = folder
        (folder / "ffmpeg").write_text(PROGRAM.format(folder=folder))
        (folder / "ffmpeg").chmod(0o755)
        self.answers(described="", counted="", status="0", listed="", packets="", words="")

    def answers(self, **texts: str) -> None:
        for name, text in texts.items():
            (self.folder / name).write_text(text)

    def film(self, frames: float, size: str = "320x240", rate: str = "10 fps", more: str = "") -> Path:
        """Return the path of a video that ffmpeg describes with this size, rate and further lines."""
        self.answers(described=HEAD.format(size=size, rate=rate) + more, counted=f"frame= 9 x\rframe= {frames:.0f} y")
        path = self.folder / "film.mp4"
        path.touch()
        return path

    def read(self, name: str) -> bytes:
        return (self.folder / name).read_bytes()

    @property
    def running(self) -> bool:
        try:
            os.kill(int(self.read("id")), 0)
        except ProcessLookupError:
            return False
        return True


@pytest.fixture
def ffmpeg(tmp_path, monkeypatch) -> Ffmpeg:
    if os.name == "nt":
        pytest.skip("needs a shell")
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "bin" / "ffmpeg"))
    return Ffmpeg(tmp_path / "bin")


@pytest.fixture(scope="session")
def ride(tmp_path_factory) -> Path:
    """Return a ride of half a minute with bends to both sides and a hard stop."""
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=100, speed_hz=1)


@pytest.fixture(scope="session")
def parked() -> tuple[api.Log, api.CalibrationFile]:
    """Return a log of 100 s at rest, and its calibration."""
    count = 201
    log = api.Log(np.arange(count) / 2.0, np.tile([0.0, 1.0, 0.0], (count, 1)), np.zeros((count, 3)), name="RIDE")
    return log, api.CalibrationFile(aligned=True)
