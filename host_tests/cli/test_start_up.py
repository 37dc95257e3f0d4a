"""`kickstand --help` starts fast: it loads no other package's command, and nothing that computes."""

import json
import resource
import subprocess
import sys

import pytest

LOADED = """
import json, sys
from kickstand_tools.cli.main import main
try:
    main(["--help"])
finally:
    print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


def test_help_loads_no_command_and_no_numpy():
    process = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    loaded = set(json.loads(process.stderr))
    assert "  fleet      Align many vehicles, find moved mounts, test their brakes." in process.stdout
    heavy = {name for name in loaded if name.partition(".")[0] in ("numpy", "rich", "dask", "jinja2")}
    leaves = {
        name for name in loaded if name.startswith(("kickstand_fleet", "kickstand_emulator", "kickstand_workshop"))
    }
    assert heavy == leaves == set()
    assert not {name for name in loaded if name.startswith("kickstand_tools.") and ".c" not in name}


def processor_s(*arguments):
    """Return the processor time of a run of Python, in s."""
    start = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - start.ru_utime - start.ru_stime


@pytest.mark.long
def test_help_takes_at_most_twice_the_time_of_its_libraries():
    """The smallest ratio of four pairs counts, because a busy machine delays single runs."""
    pairs = [(("-m", "kickstand_tools.cli", "--help"), ("-c", "import click, rich.console"))] * 4
    assert min(processor_s(*command) / processor_s(*libraries) for command, libraries in pairs) < 2.0
