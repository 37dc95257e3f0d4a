"""`kickstand evaluate`: every estimator over simulated rides and a recorded one."""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from ..errors import InputError, extra
from ..output import check_directory, new_directory
from ..progress import Bar
from ..simulation.profiles import PROFILES
from . import picture, real_ride, report
from .estimators import missing
from .runs import Job, Result, run_all, steps

_WIDTH = 110


def evaluate(
    profiles: list[str],
    seeds: int,
    seconds: float,
    upright_error_deg: float,
    pitch_change_deg: float,
    recording: Path | None,
    out: Path | None,
    as_json: bool,
    warn: Callable[[str], None],
) -> None:
    """Print the tables, or JSON; write evaluation.json and lean.png to out if given. warn: called with lines
    for standard error. Raises InputError."""
    for name in profiles:
        if name not in PROFILES:
            raise InputError(f"no profile {name}: there are {', '.join(PROFILES)}")
    if out is not None:
        picture.check()
        check_directory(out)
    absent = missing()
    if absent:
        warn(f"left out, not installed: {', '.join(absent)}: {extra('evaluate')}")
    with new_directory(out) if out is not None else contextlib.nullcontext():
        real = real_ride.compare(recording) if recording else None
        results = _ridden(
            [
                Job(name, seed, seconds, upright_error_deg, pitch_change_deg, traces=seed == 0 and out is not None)
                for seed in range(seeds)
                for name in profiles
            ]
        )
        results.sort(key=lambda r: (profiles.index(r.job.profile), r.job.seed))
        for result in results:
            if result.refusal is not None:
                warn(f"{result.job.profile}, seed {result.job.seed}, not calibrated: {result.refusal}")
        document = report.document(results, real[0] if real else None)
        if as_json:
            print(json.dumps(document, indent=2))
        else:
            console = Console()
            console = console if console.is_terminal else Console(width=_WIDTH)  # a file has no width of its own
            console.print(report.table(results))
            if real and recording:
                console.print(report.real_table(real[0], recording.name))
        if out is not None:
            (out / "evaluation.json").write_text(json.dumps(document, indent=2) + "\n", encoding="ascii")
            rides = {r.job.profile: r.traces for r in results if r.traces}
            if real and recording:
                rides[recording.name] = real[1]
            picture.draw(out / "lean.png", rides)
            warn(f"written: {out / 'evaluation.json'} and {out / 'lean.png'}")


def _ridden(jobs: list[Job]) -> list[Result]:
    with Bar("riding", len(jobs) * steps(), patience_s=0.0) as bar:
        return list(run_all(jobs, lambda: bar.advance(1)))
