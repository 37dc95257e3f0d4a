"""Every estimator compared on simulated rides and on a recorded one: what `kickstand evaluate` computes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import real_ride
from .runs import Job, Result, run_all


@dataclass
class Evaluation:
    """results: of the simulated rides, by profile, then by seed. recorded: of the recorded ride, None without one."""

    results: list[Result]
    recorded: real_ride.Comparison | None


def evaluate(jobs: list[Job], recording: Path | None = None, done: Callable[[], None] = lambda: None) -> Evaluation:
    """Simulate and score every ride, on all processors; score the estimators on the recording if one is given.

    done(): called after each of runs.steps() of each job. Raises InputError if the recording cannot be used.
    """
    profiles = list(dict.fromkeys(job.profile for job in jobs))
    recorded = real_ride.compare(recording) if recording else None
    results = sorted(run_all(jobs, done), key=lambda r: (profiles.index(r.job.profile), r.job.seed))
    return Evaluation(results, recorded)
