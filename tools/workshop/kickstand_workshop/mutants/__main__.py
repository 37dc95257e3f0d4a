"""Changes the code of a package in one place at a time, and lists the changes that its tests do not notice.

    python3 tools/dev.py mutants imu              all changes of the package
    python3 tools/dev.py mutants imu --sample 50  50 random changes, always the same for the same --seed
    python3 tools/dev.py mutants imu --file sensor.py --lines 60 90

The command works on a copy of the project. The command needs Linux or macOS, because each change is tested in a forked
process.
"""

import argparse
import collections
import difflib
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

from .changes import Change, changes
from .fork import KILLED, SURVIVED, TIMED_OUT, Tests
from .packages import PACKAGES, sources, tests

ROOT = Path(__file__).resolve().parents[4]


def main() -> int:
    options = _options()
    # Convert SIGTERM to an exception, so that the copy is removed
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))
    package = PACKAGES[options.package]
    with tempfile.TemporaryDirectory(prefix="mutants-") as directory:
        copy = Path(directory) / "project"
        # .github has a page of the documentation
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".[!g]*", ".git", "__pycache__"))
        wanted = [
            change
            for path in sources(package, copy)
            if path.match(options.file)
            for change in changes(path, copy)
            if options.lines[0] <= change.line <= options.lines[1]
        ]
        total = len(wanted)
        if options.sample and options.sample < total:
            chosen = random.Random(options.seed).sample(range(total), options.sample)
            wanted = [wanted[k] for k in sorted(chosen)]
        runner = Tests(copy, [str(path) for path in tests(package, copy)])
        if not runner.pass_unchanged():
            print(runner.output(), "The tests must pass before the code is changed.", sep="\n")
            return 2
        print(f"{options.package}: {len(wanted)} of {total} changes; unchanged the tests take {runner.seconds:.0f} s")
        return _judge(wanted, runner)


def _judge(wanted: list[Change], runner: Tests) -> int:
    """Test each change, and print the changes that no test noticed and the counts of each file.

    Returns 0 if the tests noticed all changes, otherwise 1.
    """
    counts = collections.defaultdict(collections.Counter)
    begin = time.monotonic()
    for number, change in enumerate(wanted, 1):
        original = (runner.root / change.path).read_text("utf-8")
        mutant = change.mutant(original)
        if mutant is None:
            continue
        result = runner.judge(change.path, mutant)
        counts[str(change.path)][result] += 1
        if result == SURVIVED:
            print(f"{change.path}:{change.line}", *_diff(original, mutant), sep="\n  ", flush=True)
        if number % 20 == 0:
            print(f"{number} of {len(wanted)}, {time.monotonic() - begin:.0f} s", file=sys.stderr, flush=True)
    print(f"{'killed':>8}{'timed out':>10}{'survived':>10}{'total':>8}{'noticed':>9}")
    for name, count in [*counts.items(), ("all", sum(counts.values(), collections.Counter()))]:
        noticed = 100 * (1 - count[SURVIVED] / max(1, count.total()))
        print(f"{count[KILLED]:8}{count[TIMED_OUT]:10}{count[SURVIVED]:10}{count.total():8}{noticed:7.0f} %  {name}")
    return 1 if any(count[SURVIVED] for count in counts.values()) else 0


def _diff(before: str, after: str) -> list[str]:
    """Return only the changed lines, in the form of a unified diff."""
    lines = difflib.unified_diff(before.split("\n"), after.split("\n"), n=0, lineterm="")
    return [line for line in lines if not line.startswith(("---", "+++", "@@"))]


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="dev.py mutants", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("package", choices=sorted(PACKAGES))
    parser.add_argument("--sample", type=int, help="number of changes to try (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="chooses the sample (default: 1)")
    parser.add_argument("--file", default="*.py", help="only files of this name or pattern")
    parser.add_argument("--lines", type=int, nargs=2, default=(1, 10**6), help="only lines from the first to the last")
    if not hasattr(os, "fork"):
        parser.error("this needs Linux or macOS")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
