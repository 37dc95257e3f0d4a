"""Draws two pictures of simulated rides: a ride as `plot` draws it, and three leans of one ride."""

import io
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from kickstand_sim.simulation.ride import ride as simulate_ride
from kickstand_tools.calibration.poses import fit_six_positions, fit_two_positions
from kickstand_tools.common import installation
from kickstand_tools.logs.log import Log
from kickstand_tools.replay.replay import replay
from PIL import Image

_COMMANDS = (
    "simulate --profile track --seed 1 --seconds 200 --speed --out ride",
    "calibrate six {poses} --out ride/SIX.json",
    "calibrate two ride/KICKSTAND.csv ride/UPRIGHT.csv --calibration ride/SIX.json --out ride/RIDE.cal.json",
    "plot ride/RIDE.csv --out ride",
)
_PROFILE, _SEED, _SECONDS, _SHOWN_S = "track", 1, 120.0, (40.0, 100.0)


def ride_plot() -> bytes:
    """Return the plot as PNG. The function takes 10 s, and needs the packages of `pip install -e ".[rides]"`."""
    with tempfile.TemporaryDirectory() as directory:
        for command in _COMMANDS:
            poses = " ".join(sorted(str(p.relative_to(directory)) for p in Path(directory).glob("ride/POSE_*.csv")))
            subprocess.run(
                [sys.executable, "-m", "kickstand_tools.cli", *command.format(poses=poses).split()],
                env=os.environ | {"PYTHONPATH": installation.search_path()},
                cwd=directory,
                stdout=subprocess.DEVNULL,
                check=True,
            )
        return _packed(Path(directory) / "ride" / "RIDE.png")


def _packed(picture: Any) -> bytes:
    """Return a picture as PNG with few colours. With 64 colours a plot has a third of its size with all colours."""
    packed = io.BytesIO()
    with Image.open(picture) as opened:
        opened.convert("RGB").quantize(64).save(packed, "PNG", optimize=True)
    return packed.getvalue()


def lean_compared() -> bytes:
    """Return a PNG of three leans during one minute of a simulated ride: true, by the formula, and shown.

    This takes 5 s. The function needs the packages of `pip install -e ".[rides]"`.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    ride = simulate_ride(_PROFILE, _SEED, _SECONDS)
    kickstand, upright, *poses, log = (
        Log.from_readings(readings, ride.rate_hz)
        for readings in (ride.kickstand, ride.upright, *ride.poses, ride.readings)
    )
    six = fit_six_positions(poses).calibration
    replayed = replay(log, fit_two_positions(kickstand, upright, six).calibration)
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.plot(
        replayed.t_s, replayed.lean_formula_deg, color="#e8b450", linewidth=0.5, label="the formula, each reading"
    )
    axes.plot(ride.time, ride.truth["lean_deg"], color="#2460d8", linewidth=3.0, label="true lean")
    axes.plot(replayed.t_s, replayed.lean_deg, color="#d1302a", linewidth=1.2, label="the lean filter, as shown")
    axes.set(xlim=_SHOWN_S, ylim=(-70, 70), xlabel="time, s", ylabel="lean, degrees, > 0 to the right")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", ncols=3)
    plot = io.BytesIO()
    figure.savefig(plot, dpi=100)
    return _packed(plot)
