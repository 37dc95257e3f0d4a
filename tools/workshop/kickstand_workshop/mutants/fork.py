"""Runs tests in forks of a process that has already imported numpy and similar packages, because imports take longer
than most tests."""

import contextlib
import gc
import importlib
import os
import resource
import signal
import sys
import tempfile
import time
from pathlib import Path

import pytest

WARM = ("numpy", "hypothesis", "click", "rich.console", "matplotlib.pyplot", "pandas", "plotly.graph_objects")
WARM += ("pyarrow.parquet",)
# Skips variants of tests on MicroPython: it is slow, and the same tests run on CPython.
ARGUMENTS = ("-x", "-q", "-k", "not micropython", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0")
KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"
TIMES, EXTRA_S = 3, 5  # processor time for a change: 3 times that of the unchanged tests, plus 5 s
WALL_TIMES = 10  # factor on the wall-clock time, for tests that wait for ever


class Tests:
    """root: of the copy of the project. files: the tests, relative to root. seconds: processor time of the tests of
    the unchanged code, once pass_unchanged() has run."""

    def __init__(self, root: Path, files: list[str]):
        self.root, self._files = root, files
        self.seconds = 600.0
        self._output = tempfile.TemporaryFile("w+")
        paths = [str(root / name) for name in ("tools", "tools/workshop", "firmware", "host_tests")]
        sys.path[:0] = paths
        os.environ["PYTHONPATH"] = os.pathsep.join(paths)
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.environ["MPLBACKEND"] = "Agg"
        for name in WARM:
            with contextlib.suppress(ImportError):
                importlib.import_module(name)
        gc.freeze()  # pytest collects garbage at its end, and must not scan all this each time

    def pass_unchanged(self) -> bool:
        """True if the tests pass without changes. Leaves their bytecode in the copy."""
        self._run(self._files)  # the first run writes bytecode, the second is timed
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        passed = self._run(self._files) == SURVIVED
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        sys.dont_write_bytecode = True
        return passed

    def judge(self, path: Path, mutant: str) -> str:
        """KILLED, SURVIVED or TIMED_OUT: the result of the tests with this text of the file path, relative to root.
        Tests of the same name run first."""
        file = self.root / path
        original = file.read_text("utf-8")
        for bytecode in file.parent.glob(f"__pycache__/{file.stem}.*"):
            bytecode.unlink()  # Python would use it for another text of equal length written in the same second
        try:
            file.write_text(mutant, "utf-8")
            return self._run(sorted(self._files, key=lambda name: file.stem not in name))
        finally:
            file.write_text(original, "utf-8")

    def output(self) -> str:
        """The output of the last run."""
        self._output.seek(0)
        return self._output.read()

    def _run(self, files: list[str]) -> str:
        self._output.seek(0)
        self._output.truncate()
        child = os.fork()
        if child == 0:
            self._test(files)
        limit = time.monotonic() + WALL_TIMES * (self.seconds + EXTRA_S)
        status = None
        while status is None:
            time.sleep(0.02)
            pid, ended = os.waitpid(child, os.WNOHANG)
            if pid:
                status = ended
            elif time.monotonic() > limit:
                os.killpg(child, signal.SIGKILL)
                _, status = os.waitpid(child, 0)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(child, signal.SIGKILL)  # also end the processes that the tests started
        if os.WIFSIGNALED(status):
            return TIMED_OUT
        return SURVIVED if os.WEXITSTATUS(status) == 0 else KILLED

    def _test(self, files: list[str]):
        """Never returns."""
        status = 3
        try:
            os.setpgid(0, 0)
            os.dup2(self._output.fileno(), 1)
            os.dup2(self._output.fileno(), 2)
            os.chdir(self.root)
            seconds = int(TIMES * self.seconds + EXTRA_S)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            status = int(pytest.main([*ARGUMENTS, *files]))
        finally:
            sys.stdout.flush()
            os._exit(status)
