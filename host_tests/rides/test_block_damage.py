"""A reader skips damaged blocks of a ride, and no others. It rejects blocks that no board has written."""

import math
import struct
from binascii import crc32

import pytest
from kickstand.calibration import store
from kickstand.rides import block as block_format
from kickstand_tools.rides import ride_log
from support.recordings import ride_writer


@pytest.fixture(scope="module")
def data():
    return ride_writer.blocks(3, length=lambda i: (512, 1024, 512)[i])[0]


def test_file_cut_anywhere_in_its_last_block_keeps_the_others(data):
    ride = data[0] + data[1]
    for end in [*range(512, len(ride), 7), *range(len(ride) - 10, len(ride))]:
        blocks, problems = ride_log.read(ride[:end])
        assert [block.sequence for block in blocks] == [0], end
        assert problems == ([] if end == 512 else [ride_log.CUT_SHORT]), end


def test_any_damaged_byte_loses_only_its_block_and_is_reported(data):
    for offset in [*range(0, 160, 3), *range(160, 1024, 97), *range(1014, 1024)]:
        damaged = bytearray(data[1])
        damaged[offset] ^= 0x41
        blocks, problems = ride_log.read(data[0] + bytes(damaged) + data[2])
        assert [block.sequence for block in blocks] == [0, 2], offset
        assert len(problems) == 1, offset
        assert offset in (6, 7) or problems[0].endswith(" at byte 512")


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"\xff" * 5000, "not of a ride at byte 0"),
        (b"\0" * 4096, "cut short at byte 0"),
        (b"t_s,ax_g\n0.0,1.0\n", "not of a ride at byte 0"),
        (None, "damaged at byte 0"),
    ],
)
def test_rubbish_before_a_block_is_skipped(content, problem, data):
    blocks, problems = ride_log.read((content or data[1][:900]) + data[2])
    assert [block.sequence for block in blocks] == [2] and problems == [problem]
    assert ride_log.read(b"") == ([], [])
    assert ride_log.read(b"x" * 40 + block_format.MAGIC) == ([], ["not of a ride at byte 0", "cut short"])


def sealed(data):
    """Add a valid check sum to these bytes, as an attacker would."""
    return data[:-4] + struct.pack("<I", crc32(data[:-4]))


def test_block_of_a_later_format_is_named(data):
    later = sealed(data[0][:4] + b"\x09\0" + data[0][6:])
    with pytest.raises(ride_log.BadBlock, match="format 9, this program reads 2"):
        ride_log.parse(later)


def test_block_with_impossible_values_is_bad(data):
    good = data[1]
    fields = struct.unpack_from(block_format.HEAD, good)
    head, start = struct.calcsize(block_format.HEAD), struct.calcsize(block_format.HEAD) + store.BODY_LENGTH
    # fields 7 to 9 are the units of force and rate, and the samples per second
    forged = [struct.pack(block_format.HEAD, *fields[:i], 0, *fields[i + 1 :]) + good[head:] for i in (7, 8, 9)]
    first = start - 4 * len(ride_writer.calibration().parameters())
    for value in (math.nan, math.inf, 1e38):
        forged += [good[:k] + struct.pack("<f", value) + good[k + 4 :] for k in range(first, start, 4)]
    for content in forged:
        with pytest.raises(ride_log.BadBlock, match="not decodable"):
            ride_log.parse(sealed(content))
