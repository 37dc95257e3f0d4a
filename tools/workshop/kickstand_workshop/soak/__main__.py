"""Runs `python -m kickstand_workshop.soak --hours 24 --seed 1`, and prints a table and the broken invariants.

The exit status is 1 if an invariant was broken.
"""

import sys

import click

from .soak import Tallies, soak

_WORST = {
    "wrong_s": "longest time of a lean over 10 degrees wrong, s",
    "error_deg": "largest error that stood for a second, degrees",
    "stale_s": "longest time of a lean without readings, s",
    "without_s": "longest time without a lean while riding, s",
    "memory_growth_blocks": "growth of memory in a trip, blocks",
}


def table(figures: Tallies) -> str:
    """Format the tallies as a table in Markdown."""
    rows = [
        ("simulated time", f"{figures.hours:.1f} h in {figures.host_s / 60:.0f} minutes, seed {figures.seed}"),
        ("trips", f"{figures.trips}, of which {figures.alignments} on a bike not aligned before"),
        *((f"rides: {name}", str(n)) for name, n in sorted(figures.rides.items())),
        *((name, str(n)) for name, n in sorted(figures.faults.items())),
        ("power cut in a save", str(figures.saves_cut)),
        ("presses", str(figures.presses)),
        ("changes of the display", str(figures.pages)),
        *((words, f"{figures.worst.get(name, 0.0):.1f}") for name, words in _WORST.items()),
        ("found", str(len(figures.violations))),
    ]
    return "\n".join(("| tried or seen | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)))


@click.command(context_settings={"max_content_width": 120})
@click.option("--hours", default=24.0, show_default=True, help="Simulated hours.")
@click.option("--seed", default=1, show_default=True, help="Seed of the random numbers.")
def main(hours: float, seed: int) -> None:
    """Test the firmware on the simulated board for hours, with random rides, faults and presses."""
    figures = soak(hours, seed, say=lambda line: click.echo(line, err=True))
    click.echo(table(figures))
    for line in figures.violations:
        click.echo(line, err=True)
    sys.exit(1 if figures.violations else 0)


if __name__ == "__main__":
    main()
