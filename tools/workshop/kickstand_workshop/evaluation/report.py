"""Reports an evaluation: tables for a terminal, and data for JSON. Each figure is computed over all seeds."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from rich import box
from rich.table import Table

from . import estimators
from .runs import Evaluation, LeanScore, RealScore, Result

CAPTION = (
    "possible: our filter with the true speed and a sensor with noise only; rms: over all rides; "
    "ratio: rms divided by the rms of possible; worst ride: largest rms of a ride; "
    "95 %: mean of the rides' 95th percentiles; worst: largest error; "
    "slope: shown lean divided by true lean for leans over 10 deg, mean, then lowest to highest; "
    "lag: mean; bias: largest mean error on straights in the last tenth of a ride; --: unknown from these rides"
)

_UNKNOWN = "--"


def pooled(scores: list[LeanScore]) -> dict[str, float]:
    """Summarize the scores of one estimator on one profile over all seeds.

    Returns the figures by name, in degrees, except the lag in ms. A figure is NaN if no ride determines it.
    """
    rms = np.array([s.rms_deg for s in scores])
    slopes, lags, biases = (
        [value for s in scores if not np.isnan(value := getattr(s, name))]
        for name in ("slope", "lag_ms", "straight_bias_deg")
    )
    unknown = float("nan")
    return {
        "rms": float(np.sqrt(np.mean(rms * rms))),
        "worst_ride_rms": float(rms.max()),
        "p95": float(np.mean([s.p95_deg for s in scores])),
        "worst": float(max(s.worst_deg for s in scores)),
        "slope": float(np.mean(slopes)) if slopes else unknown,
        "slope_low": min(slopes, default=unknown),
        "slope_high": max(slopes, default=unknown),
        "lag_ms": float(np.mean(lags)) if lags else unknown,
        "straight_bias": max(biases, key=abs, default=unknown),
    }


def by_profile(results: list[Result]) -> dict[str, dict[str, dict[str, float]]]:
    """Return {profile: {estimator: the figures of pooled()}}, with the "ratio" of the rms to the best possible rms."""
    summary: dict[str, dict[str, dict[str, float]]] = {}
    for profile in dict.fromkeys(r.job.profile for r in results):
        rides = [r for r in results if r.job.profile == profile and r.refusal is None]
        names = rides[0].scores if rides else {}
        summary[profile] = {name: pooled([r.scores[name] for r in rides]) for name in names}
        least = summary[profile].get(estimators.NAME, {}).get("rms", float("nan"))
        for figures in summary[profile].values():
            figures["ratio"] = figures["rms"] / least
    return summary


def table(results: list[Result]) -> Table:
    """Return a table of the simulated rides, with a block of lines per profile."""
    report = _table("Shown lean against the truth of simulated rides", CAPTION)
    report.add_column("profile (rides)", no_wrap=True)
    for head in ("rms", "ratio", "worst\nride", "95 %", "worst", "slope", "range", "lag ms", "bias"):
        report.add_column(head, justify="right")
    for profile, methods in by_profile(results).items():
        rides = sum(r.job.profile == profile and r.refusal is None for r in results)
        report.add_row(f"{profile} ({rides})", style="cyan")
        for k, (name, s) in enumerate(methods.items()):
            report.add_row(
                "  " + name,
                _shown(s["rms"], ".2f"),
                _shown(s["ratio"], ".1f"),
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
    return report


def real_table(scores: dict[str, RealScore], name: str) -> Table:
    """Return a table of the recorded ride in the file `name`."""
    report = _table(
        f"{name}: against atan(v * yaw rate / g) averaged over 1 s",
        "The reference is rough and too small. Use it to compare methods, not to measure errors in degrees.",
    )
    report.add_column("recorded ride", no_wrap=True)
    for head in ("rms", "slope beyond\n5 deg"):
        report.add_column(head, justify="right")
    for method, s in scores.items():
        style = "bold" if method == "kickstand" else ""
        report.add_row("  " + method, _shown(s.rms_deg, ".2f"), _shown(s.slope, ".3f"), style=style)
    return report


def _table(title: str, caption: str) -> Table:
    return Table(title=title, caption=caption, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), min_width=78)


def document(evaluation: Evaluation) -> dict[str, Any]:
    """Return all figures for JSON. A figure that cannot be computed from the rides is null."""
    rides = [
        {"profile": r.job.profile, "seed": r.job.seed, "refusal": r.refusal, "scores": _scores(r.scores)}
        for r in evaluation.results
    ]
    recorded = None if evaluation.recorded is None else _scores(evaluation.recorded.scores)
    data = {"profiles": by_profile(evaluation.results), "rides": rides, "recorded": recorded}
    return json.loads(json.dumps(data), parse_constant=lambda _: None)  # null, because JSON has no NaN and no infinity


def _scores(scores: Mapping[str, LeanScore | RealScore]) -> dict[str, dict[str, float]]:
    return {name: {key.removesuffix("_deg"): value for key, value in asdict(s).items()} for name, s in scores.items()}


def _shown(value: float, form: str) -> str:
    return _UNKNOWN if np.isnan(value) else format(value, form)
