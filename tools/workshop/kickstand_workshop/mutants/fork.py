"""Runs tests in forks of a process that has already imported numpy and similar packages.

Imports take longer than most tests.
"""

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
# Arguments of pytest that skip the variants of tests on MicroPython. The variants on MicroPython are slow, and the same
# tests run on CPython.
ARGUMENTS = ("-x", "-q", "-k", "not micropython", "-p", "no:cacheprovider", "-p", "no:xdist", "--hypothesis-seed=0")
KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"
# The tests of a change may use TIMES the processor time of the tests of the unchanged code, plus EXTRA_S
TIMES, EXTRA_S = 3, 5
WALL_TIMES = 10  # limit of the elapsed time, as a multiple of the limit of processor time


class Tests:
    """The tests of a package.

    root: Root of the copy of the project.
    files: Paths of the tests, relative to root.
    seconds: Processor time of the tests of the unchanged code. pass_unchanged() sets it.
    """

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
        # The end of pytest collects garbage. Scanning the imported modules for each change would take too long
        gc.freeze()

    def pass_unchanged(self) -> bool:
        """Run the tests of the unchanged code. Returns True if they pass. The copy keeps the bytecode."""
        self._run(self._files)  # the first run writes bytecode, the second is timed
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        passed = self._run(self._files) == SURVIVED
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
        sys.dont_write_bytecode = True
        return passed

    def judge(self, path: Path, mutant: str) -> str:
        """Run the tests with a changed file. Tests with the same name as the file run first.

        path: path of the file, relative to root. mutant: its changed text. Returns KILLED, SURVIVED or TIMED_OUT.
        """
        file = self.root / path
        original = file.read_text("utf-8")
        for bytecode in file.parent.glob(f"__pycache__/{file.stem}.*"):
            # Python would use the old bytecode for a changed file of the same length that is written in the same second
            bytecode.unlink()
        try:
            file.write_text(mutant, "utf-8")
            return self._run(sorted(self._files, key=lambda name: file.stem not in name))
        finally:
            file.write_text(original, "utf-8")

    def output(self) -> str:
        """Return the output of the last run."""
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
            os.killpg(child, signal.SIGKILL)  # end the processes that the tests started, too
        if os.WIFSIGNALED(status):
            return TIMED_OUT
        return SURVIVED if os.WEXITSTATUS(status) == 0 else KILLED

    def _test(self, files: list[str]):
        """Run the tests in the forked process, and end the process. Does not return."""
        status = 3
        try:
            os.setpgid(0, 0)
            # Default handlers, as at the start of a program, which some tests rely on
            for number in (signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_DFL)
            os.dup2(self._output.fileno(), 1)
            os.dup2(self._output.fileno(), 2)
            os.chdir(self.root)
            seconds = int(TIMES * self.seconds + EXTRA_S)
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            status = int(pytest.main([*ARGUMENTS, *files]))
        finally:
            sys.stdout.flush()
            os._exit(status)
