"""The computer falls asleep while the board streams a ride to it. Each print() then takes half a second. The firmware
ends the stream, and the lean continues."""

import binascii
import contextlib

import pytest
from kickstand import console, errors
from kickstand_tools.rides.block_reader import parse
from kickstand_tools.simulated_board.simulator import Board
from support import device_plans, engines

FROM_S, FOR_S = 20.0, 600.0


@pytest.fixture(autouse=True)
def just_booted(monkeypatch):
    monkeypatch.setattr(console, "_slow_ms", None)


def blocks(said):
    """Return the complete blocks in the board's output."""
    data = b""
    for line in said.splitlines():
        if line == ".":
            yield parse(data)
            data = b""
        else:
            with contextlib.suppress(binascii.Error):
                data += binascii.a2b_base64(line)


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_the_stream_ends_itself_and_the_lean_continues(engine, tmp_path, capsys):
    device_plans.align(tmp_path)
    capsys.readouterr()
    plan = {"stream": True, "lean": [[0, 0], [24, 20]], "faults": [["usb_asleep", [FROM_S, FOR_S]]], "until": 40}
    record = device_plans.run(engine, tmp_path, plan, capsys)
    assert FROM_S < record.first("USB not read") < FROM_S + 3.0
    assert record.at(39)[0] == "Lean  20° right "
    # the lean returns as early as without a stream, so nothing delays the loop any more
    assert record.first("Lean  20° right ") < 28
    streamed = list(blocks(record.console))
    assert [block.sequence for block in streamed] == list(range(len(streamed)))
    assert 35 < len(streamed) < 42
    assert record.ends[-1] == "off"  # the watchdog did not reset the board


def test_refusals_do_not_stall_the_loop_repeatedly():
    """A failure that repeats causes at most one slow print() per minute."""
    with Board(lambda t_s: (0, 1, 0, 0, 0, 0)) as board:

        def main():
            board.clock.advance(100_000)
            begun_us = board.clock.now_us
            for _ in range(600):
                board.clock.advance(100_000)
                errors.report(errors.StoreError("read-back"))
            assert board.clock.now_us - begun_us < 62_000_000

        board.faults.usb_asleep(0.0, 1000.0)
        assert board.run(main, 1000.0) == "returned"
