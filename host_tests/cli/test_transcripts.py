"""The output of the commands as a whole, on one simulated ride.

transcripts.txt has the commands, each with its output. The words must be the same, and the numbers nearly the same.
`python host_tests/cli/test_transcripts.py` writes the file again.
"""

import contextlib
import re
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from support import command

FILE = Path(__file__).with_name("transcripts.txt")
PROMPT = "$ kickstand "
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def sections():
    """Return {arguments of a command: its output} of transcripts.txt, in the order of the file."""
    _, *parts = FILE.read_text(encoding="utf-8").split(PROMPT)
    return {lines.partition("\n")[0]: lines.partition("\n")[2] for lines in parts}


def run(arguments):
    """Run a command in the current folder. Return its output, after that its output on standard error."""
    result = command.run(*arguments.split())
    return result.out + result.err + (f"exit status {result.status}\n" if result.status else "")


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    with contextlib.chdir(tmp_path_factory.mktemp("ride")), pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "80")
        return {arguments: run(arguments) for arguments in sections()}


@pytest.mark.parametrize("arguments", sections())
def test_output_is_that_of_the_transcript(arguments, outputs):
    expected, output = sections()[arguments].rstrip("\n"), outputs[arguments].rstrip("\n")
    assert NUMBER.sub("#", re.sub(" +", " ", output)) == NUMBER.sub("#", re.sub(" +", " ", expected))
    numbers, expected_numbers = ([float(number) for number in NUMBER.findall(text)] for text in (output, expected))
    assert numbers == pytest.approx(expected_numbers, rel=0.1, abs=0.25)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        texts = [f"{PROMPT}{arguments}\n{run(arguments).rstrip()}\n\n" for arguments in sections()]
    FILE.write_text("".join(texts), encoding="utf-8")
