"""Draws the plot of a simulated ride with the commands `simulate`, `calibrate` and `plot`."""

import io
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from kickstand_tools.common import firmware_path
from PIL import Image

COLOURS = 64  # enough for a plot. With this number of colours the file has a third of its size with all colours
_COMMANDS = (
    "simulate --profile track --seed 1 --seconds 200 --speed --out ride",
    "calibrate six {poses} --out ride/SIX.json",
    "calibrate two ride/KICKSTAND.csv ride/UPRIGHT.csv --calibration ride/SIX.json --out ride/RIDE.cal.json",
    "plot ride/RIDE.csv --out ride",
)


def draw() -> bytes:
    """Return the plot as PNG. The function takes 10 s, and needs the packages of `pip install -e ".[rides]"`."""
    with tempfile.TemporaryDirectory() as directory:
        for command in _COMMANDS:
            poses = " ".join(sorted(str(p.relative_to(directory)) for p in Path(directory).glob("ride/POSE_*.csv")))
            subprocess.run(
                [sys.executable, "-m", "kickstand_tools.cli", *command.format(poses=poses).split()],
                env=os.environ | {"PYTHONPATH": firmware_path.search_path()},
                cwd=directory,
                stdout=subprocess.DEVNULL,
                check=True,
            )
        with Image.open(Path(directory) / "ride" / "RIDE.png") as plot:
            packed = io.BytesIO()
            plot.convert("RGB").quantize(COLOURS).save(packed, "PNG", optimize=True)
    return packed.getvalue()
