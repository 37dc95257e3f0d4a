"""Tests the order of the measurements in a check, and which measurements are left out."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.deploy import board_files, bytecode, check
from kickstand_tools.deploy.board_files import BoardFiles, fingerprint
from kickstand_tools.deploy.check_limits import BAD, GOOD, LOOK, SKIPPED, Finding

# board_files.py, bytecode.py


def test_a_survey_of_a_board_is_parsed():
    rows = ["('/main.py', 3, b'x')", "('/kickstand', None, None)", "/rides", "(4096, 100)"]

    def surveyed(lines):
        return board_files.survey(SimpleNamespace(exec=lambda code: "\n".join(lines).encode()))  # type: ignore[arg-type]

    found = surveyed(rows)
    assert found == BoardFiles({"/main.py": (3, b"x")}, frozenset({"/kickstand"}), 4096, 100, True)
    assert not surveyed(rows[:2] + rows[3:]).has_rides
    assert fingerprint(b"abc")[0] == 3 and fingerprint(b"abc")[1].hex().startswith("ba7816bf")


def test_machine_code_is_named_by_bits_10_to_13():
    assert [bytecode.architecture(mpy) for mpy in (0x1306, 0x2B06, 1 << 10, 12 << 10)] == [
        "armv6m", "xtensawin", "x86", "rv64imc",
    ]  # fmt: skip
    for mpy in (0, 13 << 10, 0x3FF):
        with pytest.raises(bytecode.CannotCompile):
            bytecode.architecture(mpy)


def test_a_compiled_module_has_the_boards_format():
    def made(second, third, mpy=0x1306):
        return bytecode.compiled({"/a/b.py": Path("x")}, mpy, lambda source, kind: bytes([77, second, third, 31]))

    assert made(6, 0x13) == {"/a/b.mpy": bytes([77, 6, 0x13, 31])} and made(6, 0)
    for second, third in ((5, 0x13), (6, 0x12)):
        with pytest.raises(bytecode.CannotCompile, match="another format"):
            made(second, third)
    assert made(6, 0x13, 0x5306)  # bits 14 and above do not belong to the .mpy format


# check.py


def test_the_last_line_of_a_check_counts_its_faults():
    made = [Finding("a", GOOD, "x"), Finding("b", LOOK, "y"), Finding("c", SKIPPED, "z"), Finding("d", BAD, "w")]
    assert check.verdict(made) == "2 of 3 are not as they should be: b, d"
    assert check.verdict([made[0], made[2]]) == "all 1 are as they should be"
    assert [one.what for one in check.Checked("P", made).faults] == ["b", "d"]
    assert check.line(made[1]) == "look " + "b" + " " * 28 + "y"


class Answers:
    """Replaces a board: each function of check_guest.py returns its value in `values`, and the calls are recorded."""

    def __init__(self, **values):
        self.values = {
            "board": ("1", "n", "1.2", "s", ""), "button": (False, True, True, 100, 2, 3), "flash": ((9, 8), 0, 99, ""),
            "sensor": ("MPU6050", 0x68, 0x68, 0x68, "", 0), "i2c": (9, 0, 0, 90),
            "fifo": ("", 1024, 300, 700, 700, True, 1),
            "self_test": ((0, 0, 0, 0), (0.0,) * 6, (0.0,) * 6), "clock": (1200, 6_000_000, 200, 0, 0),
            "noise": (600, (0.0, 0.0, 4096.0, 0.0, 0.0, 0.0, 0.0), (4.0,) * 7, (500,) * 7, 4096, 65.5, 25.0, 0),
            "display": (0x27, False, 20, 20, ""), "speed": ("", "", 0.0), "loop": (9000, 30, 0, 0, 1, "", 99, 50_000),
        } | values  # fmt: skip
        self.calls: list[str] = []

    def __call__(self, code):
        call = code.rpartition("print(repr(")[2].partition("))\n")[0]
        if "settings.DLPF" in code:
            return "3\n"
        name = call.partition("(")[0]
        if name not in self.values:
            return ""
        self.calls.append(call)
        if isinstance(self.values[name], Exception):
            raise self.values[name]
        return f"noise\n{self.values[name]!r}\n"


def test_a_check_measures_in_its_order():
    board, said = Answers(), []
    found = check.measured(board, said.append)
    assert board.calls == [
        "board(parts)", "button(parts, 30000)", "sensor(parts)", "i2c(parts, 10000)", "flash(parts)", "fifo(parts, 1)",
        "self_test(parts)", "noise(parts, 3)", "clock(parts, 6)", "display(parts, 20)", "speed(parts)",
        "loop(parts, 15)",
    ]  # fmt: skip
    words = {one.what: one.words for one in found}
    assert "(limit 365, when the FIFO is full)" in words["flash"] and len(said) == len(found) + 1
    assert "Press the push button once, within 30 s" in said[2]


def called(**values):
    board = Answers(**values)
    found = check.measured(board, lambda text: None)
    return [call.partition("(")[0] for call in board.calls], board.calls, {one.what: one for one in found}


def test_a_check_leaves_out_what_cannot_be_measured():
    names = called(sensor=("", 0, 0, 0, "no sensor", 0))[0]
    assert names == ["board", "button", "sensor", "flash", "display", "speed", "loop"]
    names, _, found = called(sensor=("MPU6500", 0x70, 0x68, 0x68, "", 0))
    assert "self_test" not in names and found["self-test"].verdict == SKIPPED and "noise" in names
    assert "noise" not in called(fifo=("stands still", 0, 300, 0, 0, True, 1))[0]
    assert "fifo(parts, 0)" in called(flash=((9, 150), 0, 99, ""))[1]
    assert "fifo(parts, 1)" in called(flash=((9, 149), 0, 99, ""))[1]
    assert "fifo(parts, 0)" in called(flash=((9,), 0, 99, "full"))[1]
    _, _, found = called(clock=check.GuestFailed("OSError: 5"), loop=(151_000, 1, 0, 0, 1, "", 9, 50_000))
    assert found["sample clock"] == Finding("sample clock", BAD, "broken off by OSError: 5")
    # The longest pass takes over half of the 300 ms in which the FIFO fills
    assert found["longest turn"].verdict == BAD
    assert called(loop=(149_000, 1, 0, 0, 1, "", 9, 50_000))[2]["longest turn"].verdict == LOOK


def test_an_answer_that_is_no_measurement_is_refused():
    with pytest.raises(InputError, match="the board's answer to i2c makes no sense"):
        called(i2c=(1, 2))
    with pytest.raises(InputError, match="the board's answer to speed makes no sense"):
        called(speed="x")
