"""The kickstand command run inside the test process."""

import contextlib
import io
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from kickstand_tools.cli import main

HEADER = "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"
AXES = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0), "+z": (0, 0, 1), "-z": (0, 0, -1)}


@dataclass
class Result:
    status: int
    out: str
    err: str


def run(*arguments: object, err: io.StringIO | None = None) -> Result:
    """Run `kickstand arguments...`. Return its exit status and output. err: the stream to use as standard error."""
    out, err = io.StringIO(), err or io.StringIO()
    with pytest.raises(SystemExit) as leaving, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        main.main([str(argument) for argument in arguments])
    code = leaving.value.code
    assert code is None or isinstance(code, int)
    return Result(code or 0, out.getvalue(), err.getvalue())


def works(*arguments: object, err: io.StringIO | None = None) -> Result:
    """Run a command that must succeed."""
    result = run(*arguments, err=err)
    assert result.status == 0, result.err
    return result


def refused(directory: Path, *arguments: object, words: str = "") -> str:
    """Run a command that must be refused in one line with these words, and return this line.

    The command must not change `directory`.
    """
    contents = snapshot(directory)
    result = run(*arguments)
    assert result.status == 2, result.out + result.err
    assert result.err.startswith("kickstand: ")
    assert result.err.count("\n") == 1
    assert result.err.endswith("\n")
    assert "Traceback" not in result.err
    assert "unexpected" not in result.err
    assert words in result.err
    assert snapshot(directory) == contents
    return result.err


def snapshot(directory: Path) -> dict[str, bytes]:
    """Return {path: content} of all files in a directory."""
    return {str(p): p.read_bytes() for p in directory.rglob("*") if p.is_file()}


def still(path: Path, force, bias=(0.0, 0.0, 0.0), seconds: float = 3.0, seed=0) -> Path:
    """Write a log of a sensor at rest, with an MPU6050's noise.

    force: mean force, three numbers in g. bias: mean rates, three numbers in deg/s.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds * 100)
    accel = np.asarray(force) + rng.normal(scale=0.003, size=(n, 3))
    gyro = np.asarray(bias) + rng.normal(scale=0.04, size=(n, 3))
    return write(path, np.column_stack((np.arange(n) / 100, accel, gyro)))


def write(path: Path, rows) -> Path:
    """Write rows of numbers under the log's header."""
    lines = [",".join(f"{value:.5f}" for value in row) for row in rows]
    path.write_text("\n".join([HEADER, *lines]) + "\n")
    return path


def write_cal(path: Path, **changed: object) -> Path:
    """Write a valid CAL.json with some entries changed. The value None leaves an entry out."""
    data: dict[str, object] = {
        "version": 1,
        "accel_offset_g": [0.01, -0.02, 0.03],
        "accel_slope": [1.01, 0.99, 1.0],
        "gyro_bias_dps": [1.0, -2.0, 0.5],
        "vehicle_from_sensor": [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    }
    data |= changed
    path.write_text(json.dumps({key: value for key, value in data.items() if value is not None}))
    return path
