"""Tests that everything fits into a ride's block even in the worst case, and that the format of the blocks stays the
same."""

import types
from binascii import crc32

import pytest
from kickstand.rides import block as block_format
from kickstand.rides.block import RideBlock, block_length
from support.recordings import ride_writer


def some_turns(count):
    """Return passes of the loop that are the same in every version of Python."""
    for i in range(count):
        n = (2, 2, 3, 1, 8, 2)[i % 6]
        yield [n * (i * k * 7919 % 4001 - 2000) for k in range(1, 8)], n, n * 5000 + i * 37 % 400 - 200


FORMAT_1 = 1672459265  # check sum of the bytes that the next test writes


def test_the_bytes_of_a_block_are_those_of_format_1(monkeypatch):
    """Rides of older firmware must stay readable. If you change the bytes that are written, change the format's number
    and keep the reader of the old format."""
    monkeypatch.setattr(block_format, "__version__", "0.0.0")
    block = RideBlock(5000)
    block.begin(4092, 7, 3, 123456789012, ride_writer.CHIP, 200, bytes(range(80)))
    assert block_format.BODY_LENGTH == 80
    for i, turn in enumerate(some_turns(120)):
        if i % 10 == 0:
            block.add_speed(i * 13)
        block.add(*turn)
    block.add([32767] * 7, 1, 1)
    block.add([-32768] * 7, 1, 1 << 29)
    for turn in some_turns(6):
        block.add(*turn)
    block.close()
    data = bytes(block.buffer[:4092])
    assert (data[:4], data[4:6], data[6:8]) == (b"KRID", b"\1\0", (4092).to_bytes(2, "little"))
    assert block.count == 120 + 12 + 8
    assert crc32(data[:-4]) == int.from_bytes(data[-4:], "little") == FORMAT_1


def places(block):
    return sum(turn.place is not None for turn in block.turns)


@pytest.mark.parametrize("length", range(700, 720))
def test_the_worst_turn_and_a_position_fit_into_any_block(length):
    """A pass of the loop with quiet readings needs few bits. In a pass with violent readings after quiet passes, every
    number needs the longest code."""
    quiet = [800] * 7, 8, 40_000
    count = 0
    # the first round counts the quiet passes; in the second round the last pass has violent readings
    for violent in (False, True):
        block = RideBlock(5000)
        for sequence in range(2):  # only the second block reserves room for a position from its beginning on
            ride_writer.begun(length, sequence, block)
            block.add_place(ride_writer.place(0))
            while not block.full() and (not violent or not sequence or block.count < count - 1):
                block.add(*quiet)
        if violent:
            block.add_speed(1 << 24)
            block.add_place(ride_writer.place(1))
            block.add([-32768] * 7, 1, 1 << 29)
        count = block.count
        read = ride_writer.ended(block)
        assert places(read) == 1 + violent
    assert read.turns[-1].sums == (-32768,) * 6
    assert {turn.sums for turn in read.turns[:-1]} == {(800,) * 6}
    assert len(read.turns) == count - 1 > 90


def test_a_block_contains_nothing_of_the_previous_one():
    """Each block can be read without the others. A shorter block overwrites the rest of the previous block with
    zeros."""
    first, again = ride_writer.begun(4096), RideBlock(5000)
    for turn in some_turns(150):
        first.add_speed(900)
        first.add(*turn)
    first.close()
    for block in (first, again):
        ride_writer.begun(1024, 1, block)
        for turn in some_turns(5):
            block.add(*turn)
        block.close()
    assert first.buffer[:1024] == again.buffer[:1024]
    assert first.count == again.count == 5


def test_the_temperature_is_that_of_the_last_turns_mean():
    chip = types.SimpleNamespace(accel_lsb_per_g=4096, gyro_lsb_per_dps=16.4, gyro_delay_s=0.0186)
    chip.temperature_c = lambda counts: counts / 4
    block = RideBlock(5000)
    block.begin(1024, 1, 0, 0, chip, 200, bytes(80))
    block.add([0, 0, 0, 900, 0, 0, 0], 3, 15_000)
    block.add([0, 0, 0, -303, 0, 0, 0], 3, 15_000)
    found = ride_writer.ended(block)
    assert found.centidegrees == -2525
    assert found.gyro_lsb_tenths == 164
    assert found.delay_tenths_ms == 186


@pytest.mark.parametrize("index", [1, 2, 3, 4, 6, 8, 96, 1 << 12])
def test_a_littlefs_block_begins_with_a_pointer_per_halving(index):
    pointers = 1 + max(k for k in range(20) if index % (1 << k) == 0)
    assert block_length(index) == 4096 - 4 * pointers
    assert block_length(0) == 4096


def test_the_first_position_is_dropped_if_it_has_no_room():
    """After the ride's first position, every block reserves room for a position, even if it is almost full."""
    block = RideBlock(5000)
    for sequence in range(3):
        ride_writer.begun(512, sequence, block)
        sign = 1
        while not block.full():
            sign = -sign
            block.add_speed((1 << 24) * (sign > 0))
            if sequence:
                block.add_place(ride_writer.place(sequence))
            block.add([sign * 8 * 32767] * 7, 8, (1 << 29) if sign > 0 else 0)
            if block.full() and not sequence:
                block.add_place(ride_writer.place(0))
        read = ride_writer.ended(block)
        assert places(read) == (len(read.turns) if sequence else 0)
        assert read.turns[-1].sums == (sign * 8 * 32767,) * 6
