"""The stream of a ride over USB at its limits."""

import contextlib
import io
from binascii import a2b_base64

import pytest


def test_the_stream_is_base64_lines_with_a_point_per_block(clock):
    from kickstand.rides.usb_stream import RideStream

    stream = RideStream()
    assert not stream.stops_interrupts
    assert stream.begin() == 0
    assert stream.next_length() == stream.next_length() == 512
    assert stream.room() is None
    assert stream.ready() is True
    with contextlib.redirect_stdout(io.StringIO()) as said:
        stream.write(b"abc" * 50)
        stream.write(b"\0\xff")
        stream.end_block()
        stream.write(b"x")
        stream.end()
        stream.abandon()
    lines = said.getvalue().split("\n")
    assert [a2b_base64(line) for line in (lines[0], lines[1], lines[3])] == [b"abc" * 50, b"\0\xff", b"x"]
    assert lines[2] == "."
    assert lines[4:] == [""]
    assert stream.fault_code(OSError(5)) == "usb-fault"


def test_the_second_slow_print_within_a_minute_ends_the_stream(clock, monkeypatch):
    from kickstand.rides import usb_stream

    slow = []
    monkeypatch.setattr(usb_stream, "say", lambda text, end: slow.pop(0))
    stream = usb_stream.RideStream()
    stream.begin()
    slow += [False, True, False]
    for _ in range(3):
        stream.write(b"x")
    clock.advance(60_100_000)
    slow += [True]
    stream.end_block()
    clock.advance(59_000_000)
    slow += [True]
    with pytest.raises(OSError):
        stream.write(b"x")
    stream.begin()  # a new ride forgets the earlier slow print
    slow += [True]
    stream.write(b"x")
