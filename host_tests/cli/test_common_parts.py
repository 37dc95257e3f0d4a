"""Small parts that all commands share: times, drawings, templates, files, messages, and where the firmware is."""

import gzip
import io
import os
import pickle
import sys
from importlib import metadata
from pathlib import Path

import jinja2
import pytest
from kickstand_tools.common import (
    errors,
    firmware_path,
    messages,
    output,
    plugins,
    progress,
    svg,
    templates,
    times,
    unix_port,
)
from kickstand_tools.common.errors import InputError, RefusedInput
from kickstand_tools.common.messages import Message, Plain, Remedy, WrongAxes


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "0:00"),
        (9.6, "0:10"),
        (59.4, "0:59"),
        (59.6, "1:00"),
        (61, "1:01"),
        (3599, "59:59"),
        (3600, "1:00:00"),
        (3723, "1:02:03"),
        (36061, "10:01:01"),
    ],
)
def test_a_time_is_written_as_on_a_clock(seconds, text):
    assert times.clock(seconds) == text


def test_a_time_axis_has_six_to_twelve_round_ticks():
    for seconds in (13.0, 25.0, 61.0, 119.0, 241.0, 900.0, 1439.0, 3000.0, 10_000.0, 21_599.0):
        tick = times.tick_s(seconds)
        assert tick in (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800)
        assert seconds / tick < 12.0
    assert [times.tick_s(seconds) for seconds in (11.9, 12.0, 24.0, 60.0, 120.0, 240.0)] == [1, 2, 5, 10, 20, 30]
    assert [times.tick_s(seconds) for seconds in (360.0, 720.0, 1440.0, 3600.0, 7200.0)] == [60, 120, 300, 600, 1800]
    assert times.tick_s(21_600.0) == 3600


def test_a_drawing_is_a_file_of_its_elements():
    text = svg.element("text", "1 < 2 & 3", x=1 / 3, font_weight=None, text_anchor="end", class_="a<b")
    assert text == '<text x="0.33" text-anchor="end" class="a&lt;b">1 &lt; 2 &amp; 3</text>'
    assert svg.element("g", text) == f"<g>{text}</g>"  # an element inside another element is not escaped again
    assert svg.element("rect", width=200000, y=-0.006) == '<rect width="200000" y="-0.01"/>'
    whole = svg.drawing((10.125, 20), svg.element("g"), role="img")
    assert whole == ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 10.12 20" role="img">\n<g/>\n</svg>\n')
    assert svg.path([(0, 0.004), (1.5, 2), (-3, 1e6)]) == "M0 0L1.5 2L-3 1000000"


def test_a_template_escapes_its_values_and_lacks_none(tmp_path):
    page = tmp_path / "page.html"
    page.write_text("{% if shown %}\n  <p>{{ name }}</p>\n{% endif %}\n{{ values | tojson }}\n")
    filled = templates.filled(page, shown=True, name="<b>°", values=["°", "</script>"])
    assert filled == '  <p>&lt;b&gt;°</p>\n["°", "\\u003c/script\\u003e"]\n'
    assert templates.filled(page, shown=False, name="", values=1) == "1\n"
    with pytest.raises(jinja2.UndefinedError):
        templates.filled(page, shown=True, values=1)
    with pytest.raises(ValueError):
        templates.filled(page, shown=False, values=float("nan"))
    # the well-known hash of an empty text
    assert templates.source_hash("") == "'sha256-47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU='"


def test_only_names_that_end_in_gz_are_packed(tmp_path):
    for name in ("a.csv", "a.csv.gz"):
        output.write_packed(tmp_path / name, [b"one\n", b"two\n"])
    assert (tmp_path / "a.csv").read_bytes() == b"one\ntwo\n"
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()) == b"one\ntwo\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.csv.gz"]
    with pytest.raises(InputError, match="cannot be written"):
        output.write_packed(tmp_path / "none" / "a.csv", [b""])


def test_an_output_must_be_a_new_or_ordinary_file(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("a log")
    (tmp_path / "same.csv").hardlink_to(log)
    other = tmp_path / "other.csv"
    output.check_output(other, [log])
    other.write_text("an earlier result")
    output.check_output(other, [log, tmp_path / "none.csv"])
    for path, why in (
        (tmp_path, "is a directory: give --out the name of a file"),
        (log, "is also an input: give --out another name"),
        (tmp_path / "same.csv", "is also an input"),
        (tmp_path / "none" / "a.csv", "there is no directory"),
    ):
        with pytest.raises(InputError, match=why):
            output.check_output(path, [other, log])
    output.check_directory(tmp_path)
    output.check_directory(tmp_path / "new")
    with pytest.raises(InputError, match="is a file: give --out the name of a directory"):
        output.check_directory(log)


@pytest.mark.skipif(os.name == "nt", reason="needs a named pipe and links")
def test_a_pipe_is_refused_and_a_link_is_followed(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="is not an ordinary file"):
        output.check_output(tmp_path / "pipe", [])
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    with output.whole_file(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"


def test_a_temporary_file_keeps_the_ending(tmp_path):
    with output.whole_file(tmp_path / "plot.svg") as temporary:
        assert temporary.suffix == ".svg" and temporary.parent == tmp_path and temporary.name.startswith(".")
        temporary.write_text("")


def test_only_new_and_empty_directories_are_removed(tmp_path):
    with output.new_directory(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b").is_dir()
    assert not (tmp_path / "a").exists()
    with output.new_directory(tmp_path / "c" / "d"):
        (tmp_path / "c" / "kept").write_text("")
    assert [path.name for path in (tmp_path / "c").iterdir()] == ["kept"]
    output.make_directory(tmp_path / "e" / "f")
    output.make_directory(tmp_path / "e" / "f")
    assert (tmp_path / "e" / "f").is_dir()
    for make in (output.make_directory, lambda path: output.new_directory(path).__enter__()):
        with pytest.raises(InputError, match="cannot be made"):
            make(tmp_path / "c" / "kept" / "x")


class Late(Message):
    late_s: float
    name: str

    code = "late"
    text = "{name} is {late_s:.1f} s late"
    todo = Remedy("run it with --shift {late_s:.0f}", "shift it by {late_s:.0f} s")


class Turned(WrongAxes):
    code = "turned"
    text = "the axes are turned"


def test_a_message_has_words_for_a_terminal_and_for_a_page():
    late = Late(2.04, "a.csv")
    assert late.line() == messages.sentence(late) == "a.csv is 2.0 s late: run it with --shift 2"
    assert late.line(page=True) == messages.sentence(late, True) == "a.csv is 2.0 s late: shift it by 2 s"
    assert late.values == (2.04, "a.csv")
    assert Turned().line() == "the axes are turned"
    more = Remedy("run x", "press x").followed("; wait")
    assert (more.words(), more.words(True)) == ("run x; wait", "press x; wait")
    both = Remedy("wait {n} s").followed(" or stop").filled(n=3)
    assert both.words() == both.words(True) == "wait 3 s or stop"
    assert Plain("it is {broken}", Remedy("stop")).line() == "it is {broken}: stop"
    assert messages.by_code(Late, Turned) == {"late": Late, "turned": Turned}
    assert messages.distinct([late, Turned(), Late(2.04, "a.csv")]) == [late, Turned()]
    assert messages.is_explained([late, Turned()]) and not messages.is_explained([late])


def test_a_refusal_keeps_its_reason_in_another_process():
    refused = RefusedInput(Turned(), "a.csv", ", as it seems")
    again = pickle.loads(pickle.dumps(refused))
    assert str(again) == str(refused) == "a.csv: the axes are turned, as it seems"
    assert (again.code, again.message) == ("turned", Turned())
    assert str(refused.at("b.csv")) == "b.csv: the axes are turned, as it seems"
    assert str(RefusedInput(Turned())) == "the axes are turned"
    error = InputError("no such file", Remedy("run x", "press x"))
    assert (str(error), error.line(True)) == ("no such file: run x", "no such file: press x")
    assert str(InputError(Late(1.0, "b"))) == "b is 1.0 s late: run it with --shift 1"


def test_the_cause_of_an_error_has_no_number():
    assert errors.cause(PermissionError(13, "Permission denied", "a.csv")) == "Permission denied"
    assert errors.cause(ValueError("odd")) == "odd"
    assert errors.cause(TimeoutError()) == "TimeoutError"


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """Make the tools believe that they were installed from a wheel into this directory."""
    monkeypatch.setattr(firmware_path, "TOOLS", tmp_path / "site-packages")
    (tmp_path / "site-packages" / "kickstand_tools" / "firmware").mkdir(parents=True)
    return tmp_path / "site-packages"


def test_in_a_checkout_the_firmware_and_config_are_the_checkouts(tmp_path, monkeypatch):
    root = Path(__file__).resolve().parents[2]
    assert not firmware_path.installed()
    assert firmware_path.directory() == root / "firmware"
    assert firmware_path.documents() == root
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.py").write_text("")
    assert firmware_path.config() == root / "firmware" / "config.py"  # only an installed package uses its own config.py
    (tmp_path / "firmware" / "kickstand").mkdir(parents=True)
    assert firmware_path.config() == root / "firmware" / "config.py"  # the folder is not a checkout yet
    (tmp_path / "firmware" / "config.py").write_text("")
    assert firmware_path.config() == tmp_path / "firmware" / "config.py"
    assert errors.extra("web") == f'{sys.executable} -m pip install -e "{root}[web]"'


def test_an_installed_package_uses_the_users_config(wheel, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert firmware_path.directory() == wheel / "kickstand_tools" / "firmware"
    assert firmware_path.documents() == wheel / "kickstand_tools" / "documents"
    assert firmware_path.config() == firmware_path.directory() / "config.py"
    (tmp_path / "config.py").write_text("")
    assert firmware_path.config() == tmp_path / "config.py"
    assert errors.extra("web") == f'{sys.executable} -m pip install "kickstand-lean[web]"'


def test_another_process_finds_the_firmware_and_the_tools():
    paths = firmware_path.search_path().split(os.pathsep)
    assert [(Path(paths[0]) / "kickstand_tools").is_dir(), (Path(paths[1]) / "kickstand" / "lean").is_dir()] == [
        True
    ] * 2
    assert unix_port.environment()["MICROPYPATH"].split(":")[-1] == ".frozen"
    command = unix_port.command("a.py", "b", "c")
    assert command[0] == sys.executable and command[-3:] == ["a.py", "b", "c"]


def test_the_projects_own_part_is_preferred(monkeypatch):
    class Distribution:
        def __init__(self, name, *entries):
            self.name, self._entries = name, entries

        @property
        def entry_points(self):
            if not self._entries:
                raise ValueError("the metadata cannot be read")
            return [metadata.EntryPoint(name, value, group) for group, name, value in self._entries]

    others = Distribution("other", ("g", "a", "os:sep"), ("g", "b", "os:linesep"), ("h", "c", "os:curdir"))
    ours = Distribution("kickstand-lean", ("g", "a", "os:pardir"))
    third = Distribution("third", ("g", "a", "os:name"), ("g", "b", "os:name"))
    monkeypatch.setattr(plugins, "distributions", lambda: [Distribution("broken"), others, ours, third])
    assert (plugins.part("g", "a"), plugins.part("g", "b")) == (os.pardir, os.linesep)
    assert set(plugins.entry_points("g")) == {"a", "b"}
    with pytest.raises(InputError, match="the part c of kickstand-lean is not installed"):
        plugins.part("g", "c")


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_appears_after_a_second_of_work(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    now_s = [10.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s[0])
    for after_s, seen in ((0.9, False), (1.1, True)):
        shown = Terminal()
        monkeypatch.setattr(sys, "stderr", shown)
        with progress.Bar("riding", 4) as bar:
            bar.describe("walking")
            now_s[0] += after_s
            bar.advance(1)
        assert ("walking" in shown.getvalue()) is seen
        assert "riding" not in shown.getvalue()


def test_lines_of_progress_come_after_their_interval(monkeypatch, capsys):
    now_s = [10.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s[0])
    with progress.Bar("riding", 4, lines_s=10.0) as bar:
        for after_s in (9.0, 2.0, 9.0, 1.0):
            now_s[0] += after_s
            bar.advance(1)
    assert capsys.readouterr().err.splitlines() == ["riding: 50 %", "riding: 100 %"]
