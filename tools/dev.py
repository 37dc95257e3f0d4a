#!/usr/bin/env python3
"""One command per task, on a machine with only Python 3.11 or newer:

    python3 tools/dev.py demo            the firmware on a simulated board, live in the terminal
    python3 tools/dev.py test            ruff, pyright and the default tier of the tests: five minutes on two cores
    python3 tools/dev.py test --changed  only the tests that the changed files can reach by imports
    python3 tools/dev.py test --all      also the long tier

Further arguments of `test` go to pytest.

Each command creates .venv beside pyproject.toml, and installs the project in it; `test` also installs the packages
beside it, such as tools/fleet. It installs again only if a pyproject.toml has changed.
"""

import glob
import hashlib
import os
import subprocess
import sys
import textwrap
import time

TOOLS = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(TOOLS)
VENV = os.path.join(ROOT, ".venv")
PYTHON = os.path.join(VENV, "Scripts", "python.exe") if os.name == "nt" else os.path.join(VENV, "bin", "python")
STAMP = os.path.join(VENV, "installed.txt")
LOG = os.path.join(VENV, "install.log")
OLDEST = (3, 11)
# {task: what pip installs for it}. A later entry contains the earlier ones
INSTALLATIONS = {"": ["."], "test": [".[test]", "tools/fleet[s3,test]", "tools/emulator"]}
NAMES = list(INSTALLATIONS)
REPORT_S = 5  # time between two lines of progress while installing
COMPILE = "from kickstand_emulator import native; native.build()"  # compiled, the emulated Pico is twice as fast


class SetupStopped(Exception):
    """The set-up cannot continue. The text is one line: the reason, and what to do."""


def main(arguments):
    if sys.version_info < OLDEST:
        raise SetupStopped(
            "Python 3.11 or newer is needed, this is %d.%d: start it with a newer python3" % sys.version_info[:2]
        )
    if not arguments or arguments[0] not in ("demo", "test"):
        raise SetupStopped("no task is named: run %s demo or test" % sys.argv[0])
    name, rest = arguments[0], arguments[1:]
    prepare("" if name == "demo" else name)
    if name == "test":
        return test(rest)
    return run("-m", "kickstand_tools.cli", "demo", *rest)


def test(arguments):
    """Run ruff, pyright and the tests, and show the time. Returns 0 if all succeed, otherwise 1."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # if set, each process that a test starts compiles its imports
    begin = time.time()
    complete = "--all" in arguments
    if "--changed" in arguments:
        arguments = [a for a in arguments if a != "--changed"] + reached_tests(changed_files())
    beside = [  # these run beside the tests, because each uses one processor for a part of the time
        start("ruff", "-m", "ruff", "check", "."),
        start("ruff format", "-m", "ruff", "format", "--check", "."),
        start("pyright", "-m", "pyright"),
    ]
    subprocess.call([PYTHON, "-c", COMPILE], cwd=ROOT)
    processes = (os.cpu_count() or 1) + complete  # the long tier has tests of pages, which often wait
    pytest = ("-m", "pytest", "-n", str(processes), "--dist", "loadfile", "--no-loadscope-reorder", "--durations", "10")
    failed = ["pytest"] if run(*pytest, *arguments) != 0 else []
    for name, process in beside:
        say("%s: %s" % (name, process.communicate()[0].strip()))
        if process.returncode != 0:
            failed.append(name)
    say(
        "%s tier: %.0f s, %.0f s of processor time%s"
        % (
            "long" if complete else "default",
            time.time() - begin,
            sum(os.times()[2:4]),
            ", failed: " + ", ".join(failed) if failed else "",
        )
    )
    return 1 if failed else 0


def changed_files():
    """Return the paths that differ from the branch main of origin, or from the last commit, and the untracked paths.

    Removed files are left out.
    """
    git = ("git", "-c", "core.quotePath=off")  # otherwise git writes other characters than ASCII as numbers
    for base in ("origin/main", "HEAD"):
        common = output(*git, "merge-base", base, "HEAD")
        if common:
            paths = output(*git, "diff", "--name-only", common[0])
            paths += output(*git, "ls-files", "-o", "--exclude-standard")
            return sorted({path for path in paths if os.path.exists(os.path.join(ROOT, path))})
    return []


def reached_tests(files):
    """Return the arguments for pytest: the test files that these changed files can reach."""
    tests = output(PYTHON, "-m", "kickstand_workshop.reach", *files) if files else []
    if not tests:
        raise SetupStopped("no test is reached by what has changed: leave out --changed to run all")
    return tests


def output(*command):
    """Return the lines that a command prints and that are not empty, or [] if it fails."""
    process = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, encoding="utf-8")
    return [line for line in process.stdout.splitlines() if line] if process.returncode == 0 else []


def start(name, *arguments):
    """Start .venv's Python beside the tests. Returns the name and the process."""
    process = subprocess.Popen(
        [PYTHON, *arguments], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8"
    )
    return name, process


def prepare(name):
    """Create .venv and make this one of INSTALLATIONS, unless this is already done."""
    place = "Python %s in %s" % (sys.version.split()[0], ROOT)
    projects = [os.path.join(ROOT, "pyproject.toml")] + sorted(glob.glob(os.path.join(TOOLS, "*", "pyproject.toml")))
    version = hashlib.sha256("".join(map(read, projects)).encode()).hexdigest()
    earlier_place, installed, *_ = (read(STAMP) + "\n\n").split("\n")
    if earlier_place != place and earlier_place.endswith(" in " + ROOT) and has_pip():
        was, now = earlier_place.partition(" in ")[0], place.partition(" in ")[0]
        say(".venv has %s and is used as it is; for %s remove .venv first" % (was, now))
        place = earlier_place
    if earlier_place == place and installed in [version + " " + n for n in NAMES[NAMES.index(name) :]]:
        return
    if earlier_place not in ("", place) or not has_pip():
        make_venv()
    if os.path.exists(STAMP):
        os.remove(STAMP)  # an interrupted installation starts again
    install(name)
    with open(STAMP, "w", encoding="utf-8") as file:
        file.write("%s\n%s %s\n" % (place, version, name))


def make_venv():
    """Create a fresh .venv with pip."""
    say("creating .venv with Python %s" % sys.version.split()[0])
    made = subprocess.run(
        [sys.executable, "-m", "venv", "--clear", VENV],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
    )
    if "ensurepip" in made.stdout or "No module named venv" in made.stdout:
        raise SetupStopped(
            "this Python has no venv and pip: on Debian or Ubuntu install python3-venv, then repeat this"
        )
    if made.returncode != 0:
        raise SetupStopped(".venv cannot be created: %s" % last_line(made.stdout))
    if not has_pip():
        raise SetupStopped(
            "there is no pip in the new .venv: on Debian or Ubuntu install python3-venv, then repeat this"
        )


def has_pip():
    """Return True if .venv exists and its pip runs."""
    if not os.path.exists(PYTHON):
        return False
    command = [PYTHON, "-m", "pip", "--version"]
    return subprocess.call(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) == 0


def install(name):
    """Install one of INSTALLATIONS in editable mode, with uv, which takes a fifth of pip's time, or with pip.

    pip is used if its settings name another index, because uv does not read these settings, and if uv fails.
    """
    say("installing %sinto .venv: a few minutes at most" % ("with the %s tools " % name if name else ""))
    what = [word for project in INSTALLATIONS[name] for word in ("--editable", project)]
    pip = [PYTHON, "-m", "pip", "install", "--no-input", "--disable-pip-version-check"]
    uv = [PYTHON, "-m", "uv", "pip", "install", "--python", PYTHON]
    quick = not own_index() and watched(pip + ["--only-binary", "uv", "uv>=0.8,<1"]) == 0 and watched(uv + what) == 0
    if quick:
        return
    if watched(pip + what) != 0:
        errors = [line[6:].strip() for line in read(LOG).split("\n") if line.startswith("ERROR:")]
        why = errors[-1] if errors else last_line(read(LOG))
        raise SetupStopped("installing failed: %s (is there a network? the whole output of pip is in %s)" % (why, LOG))


def own_index():
    """Return True if pip's settings name another index than PyPI."""
    settings = subprocess.run([PYTHON, "-m", "pip", "config", "list"], stdout=subprocess.PIPE).stdout
    return b".index-url=" in settings


def watched(command):
    """Run a command that may take minutes, and return its exit status. Print the last line of its log regularly."""
    begin = time.time()
    with open(LOG, "wb") as log:
        process = subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
        while True:
            try:
                return process.wait(REPORT_S)
            except subprocess.TimeoutExpired:
                line = textwrap.shorten(last_line(read(LOG)), 70, placeholder=" ...")
                say("  %3.0f s  %s" % (time.time() - begin, line))


def run(*arguments):
    """Run .venv's Python in the project's root and return its exit status."""
    return subprocess.call([PYTHON] + list(arguments), cwd=ROOT)


def read(path):
    """Return the content of a text file, or "" if the file is missing."""
    if not os.path.exists(path):
        return ""
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def last_line(text):
    lines = text.strip().split("\n")
    return lines[-1].strip()


def say(text):
    print(text, flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except SetupStopped as stop:
        sys.exit("dev.py: %s" % stop)
    except KeyboardInterrupt:
        sys.exit(130)
    except OSError as error:
        sys.exit("dev.py: %s" % error)
