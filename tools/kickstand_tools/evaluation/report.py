"""The figures of an evaluation: pooled over seeds, as a table and for machines."""

from dataclasses import asdict
from typing import Any

import numpy as np
from rich import box
from rich.table import Table

from .metrics import Score
from .real_ride import RealScore
from .runs import Result

CAPTION = (
    "rms: over all rides; worst ride: rms of the worst; 95 %: mean over rides; worst: of all; "
    "slope: shown over true beyond 10 deg, mean, then lowest to highest; lag: mean; "
    "bias: the largest on straights in the last tenth; --: nothing in these rides tells it"
)

_UNKNOWN = "--"


def pooled(scores: list[Score]) -> dict[str, float]:
    """One estimator's scores on one profile, over the seeds, NaN where no seed tells. Degrees, ms."""
    rms = np.array([s.rms for s in scores])
    slopes, lags, biases = (
        [value for s in scores if not np.isnan(value := getattr(s, name))]
        for name in ("slope", "lag_ms", "straight_bias")
    )
    nothing = float("nan")
    return {
        "rms": float(np.sqrt(np.mean(rms * rms))),
        "worst_ride_rms": float(rms.max()),
        "p95": float(np.mean([s.p95 for s in scores])),
        "worst": float(max(s.worst for s in scores)),
        "slope": float(np.mean(slopes)) if slopes else nothing,
        "slope_low": min(slopes, default=nothing),
        "slope_high": max(slopes, default=nothing),
        "lag_ms": float(np.mean(lags)) if lags else nothing,
        "straight_bias": max(biases, key=abs, default=nothing),
    }


def by_profile(results: list[Result]) -> dict[str, dict[str, dict[str, float]]]:
    """profile -> estimator -> pooled()."""
    summary: dict[str, dict[str, dict[str, float]]] = {}
    for profile in dict.fromkeys(r.job.profile for r in results):
        rides = [r for r in results if r.job.profile == profile and r.refusal is None]
        names = rides[0].scores if rides else {}
        summary[profile] = {name: pooled([r.scores[name] for r in rides]) for name in names}
    return summary


def table(results: list[Result]) -> Table:
    """A block of lines for each profile."""
    made = _table("Shown lean against the truth of simulated rides", CAPTION)
    made.add_column("profile (rides)", no_wrap=True)
    for head in ("rms", "worst\nride", "95 %", "worst", "slope", "range", "lag ms", "bias"):
        made.add_column(head, justify="right")
    for profile, methods in by_profile(results).items():
        rides = sum(r.job.profile == profile and r.refusal is None for r in results)
        made.add_row(f"{profile} ({rides})", style="cyan")
        for k, (name, s) in enumerate(methods.items()):
            made.add_row(
                "  " + name,
                _shown(s["rms"], ".2f"),
                _shown(s["worst_ride_rms"], ".2f"),
                _shown(s["p95"], ".2f"),
                _shown(s["worst"], ".1f"),
                _shown(s["slope"], ".3f"),
                f"{s['slope_low']:.2f}-{s['slope_high']:.2f}" if s["slope"] == s["slope"] else _UNKNOWN,
                _shown(s["lag_ms"], "z.0f"),
                _shown(s["straight_bias"], "+z.2f"),
                style="bold" if name == "kickstand" else "",
                end_section=k == len(methods) - 1,
            )
    return made


def real_table(scores: dict[str, RealScore], name: str) -> Table:
    """The recorded ride."""
    made = _table(
        f"{name}: against atan(v * yaw rate / g) averaged over 1 s",
        "a rough reference that reads low: it compares methods, it claims no degrees",
    )
    made.add_column("recorded ride", no_wrap=True)
    for head in ("rms", "slope beyond\n5 deg"):
        made.add_column(head, justify="right")
    for method, s in scores.items():
        style = "bold" if method == "kickstand" else ""
        made.add_row("  " + method, _shown(s.rms, ".2f"), _shown(s.slope, ".3f"), style=style)
    return made


def _table(title: str, caption: str) -> Table:
    """Narrow enough for 80 columns."""
    return Table(title=title, caption=caption, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), min_width=78)


def document(results: list[Result], real: dict[str, RealScore] | None) -> dict[str, Any]:
    """Everything for a JSON file; what could not be told is null."""
    rides = [
        {
            "profile": r.job.profile,
            "seed": r.job.seed,
            "refusal": r.refusal,
            "scores": {name: asdict(s) for name, s in r.scores.items()},
        }
        for r in results
    ]
    recorded = None if real is None else {name: asdict(s) for name, s in real.items()}
    return _without_nan({"profiles": by_profile(results), "rides": rides, "recorded": recorded})


def _shown(value: float, form: str) -> str:
    return _UNKNOWN if np.isnan(value) else format(value, form)


def _without_nan(value: Any) -> Any:
    """NaN is no JSON."""
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
