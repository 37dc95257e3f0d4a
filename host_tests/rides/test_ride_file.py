"""The format of recorded rides is exact on both engines. A reader skips damaged blocks, but no other blocks."""

import io
import math
import random
import struct
import threading
from binascii import crc32
from dataclasses import replace

import numpy as np
import pytest
from kickstand import __version__
from kickstand.calibration import store
from kickstand.rides import block as block_format
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.replay.replay import replay
from kickstand_tools.rides import block_reader, ride_log, stream
from support.mpy import run_mpy
from support.recordings import ride_writer
from support.recordings.ride_writer import CHIP

_EXTREMES = [
    ([32767] * 7, 1, 1),
    ([-32768] * 7, 1, 5000),
    ([8 * 32767, -8 * 32768, 0, 0, 8 * 32767, -8 * 32768, 1], 8, 40000),
    ([0] * 7, 1, block_format.MAX_DT_US),
    ([1, -1, 4096, 0, 0, -1, 1], 2, 9999),
]

# Encode random entries with machine code and with Python. Most entries are typical. Machine code and Python must give
# the same states and bytes.
_BOTH = """
import random
from array import array
from kickstand.rides import block as block_format
from kickstand.rides.block import encode, encode_python
assert encode is not encode_python
random.seed(1)
for block in range(100):
    states, outs = [], []
    for _ in range(2):
        state = array("i", [0] * (block_format._PERIOD + 1))
        state[0] = 1
        for i in range(block_format.FIELDS):
            state[block_format._MEANS + i] = block_format.START_MEAN
        state[block_format._PERIOD] = 5000
        states.append(state)
        outs.append(bytearray(4096))
    while states[0][block_format._AT] < 4096 - 60:
        wide = random.choice((10, 300, 32767))
        n = random.choice((0, 1, 2, 2, 2, 8))
        entry = array("i", [n, n * 5000 + random.randint(-200, 200)])
        if random.random() < 0.01:
            entry[1] = random.randint(0, block_format.MAX_DT_US)
        for _ in range(6):
            entry.append(random.randint(-max(1, n) * (wide + 1), max(1, n) * wide))
        entry.append(random.choice((0, random.randint(0, 30000), random.randint(0, 1 << 24))))
        for function, state, out in zip((encode, encode_python), states, outs):
            function(entry, state, out)
        assert states[0] == states[1], (list(entry), states)
    assert outs[0] == outs[1]
print("equal")
"""


def written(turns):
    block = block_format.RideBlock(5000)
    block.begin(4092, 7, 3, 123456789012, CHIP, 200, bytes(80))
    for turn in turns:
        block.add(*turn)
    block.close()
    return bytes(block.buffer[: block.length])


def held(block):
    """Return [(sums, n, dt_us), ...] of the entries in a block."""
    times = [block.time_us] + [turn.time_us for turn in block.turns]
    return [(t.sums, t.n, t.time_us - before) for t, before in zip(block.turns, times[:-1], strict=True)]


def test_every_turn_comes_back_exactly():
    """The written passes of the loop include passes with the largest numbers."""
    turns = [*_EXTREMES, *ride_writer.turns(200), *_EXTREMES]
    data = written(turns)
    block = block_reader.parse(data)
    assert held(block) == [(tuple(s[:3] + s[4:]), n, dt_us) for s, n, dt_us in turns]
    assert (block.ride, block.sequence, block.time_us) == (7, 3, 123456789012)
    assert (block.accel_lsb_per_g, block.gyro_lsb_tenths, block.sample_hz) == (4096, 655, 200)
    assert (block.centidegrees, block.firmware, block.delay_tenths_ms) == (3125, __version__, 134)


def test_a_ride_of_version_0_3_0_has_no_delay(tmp_path):
    """In rides of version 0.3.0 the byte of the delay was the last of the twelve bytes of the firmware's version. It
    was always 0."""
    data = bytearray(ride_writer.blocks(1)[0][0])
    data[43] = 0
    data[-4:] = struct.pack("<I", crc32(data[:-4]))
    block = block_reader.parse(bytes(data))
    assert (block.firmware, block.delay_tenths_ms) == (__version__, 0)
    cal = read_calibration(ride_log.write(tmp_path / "ride.csv", [block]))
    assert (cal.gyro_delay_s, cal.delay_s()) == (None, 0.0048)


def test_a_replay_subtracts_the_delay_of_the_ride(tmp_path):
    cal = read_calibration(ride_log.write(tmp_path / "ride.csv", [block_reader.parse(ride_writer.blocks(1)[0][0])]))
    assert cal.gyro_delay_s == 0.0134  # the delay with DLPF 5
    late, early = (replay(tmp_path / "ride.csv", replace(cal, gyro_delay_s=delay_s)) for delay_s in (None, 0.0134))
    ahead = early.lean_deg - late.lean_deg
    assert np.abs(ahead - (0.0134 - 0.0048) * early.roll_rate_dps)[200:].max() < 0.02
    assert np.abs(ahead).max() > 0.02
    again = replay(tmp_path / "ride.csv", cal, engine="micropython")
    assert np.abs(again.lean_deg - early.lean_deg).max() < 0.01


def test_machine_code_codes_as_python_does():
    assert run_mpy(_BOTH) == "equal\n"


def test_blocks_have_speeds_and_calibration_and_never_overflow():
    data, turns = ride_writer.blocks(20, speed=True, trim_deg=1.25)
    assert [len(block) for block in data] == [4096, 4092, 4088, 4092, 4084] + [
        4096 - 4 * ((i & -i).bit_length()) for i in range(5, 20)
    ]
    found, problems = block_reader.read(b"".join(data))
    assert problems == []
    assert [turn for block in found for turn in held(block)] == turns
    speeds = [(i, t.speed_mps) for i, t in enumerate(t for b in found for t in b.turns) if t.speed_mps is not None]
    assert speeds == [(i, i / 100) for i in range(0, len(turns), 100)]
    kept, wanted = found[0].calibration(), ride_writer.calibration(1.25)
    for name in ("accel_offset", "accel_slope", "gyro_bias", "vehicle_from_sensor"):
        assert list(getattr(kept, name)) == list(getattr(wanted, name))
    assert (kept.trim_deg, kept.aligned, kept.six_done) == (1.25, True, True)


def test_a_file_cut_anywhere_in_its_last_block_keeps_the_others():
    data, _ = ride_writer.blocks(2, length=lambda i: (512, 4092)[i])
    whole = b"".join(data)
    for end in [*range(len(data[0]), len(whole), 23), *range(len(whole) - 10, len(whole))]:
        found, problems = block_reader.read(whole[:end])
        assert [block.sequence for block in found] == [0], end
        assert problems == ([] if end == len(data[0]) else [block_reader.CUT_SHORT]), end


def test_any_damaged_byte_loses_only_its_block_and_is_reported():
    data, _ = ride_writer.blocks(3)
    for at in [*range(0, 160, 3), *range(160, len(data[1]), 197), *range(len(data[1]) - 10, len(data[1]))]:
        spoilt = bytearray(data[1])
        spoilt[at] ^= 0x41
        found, problems = block_reader.read(data[0] + bytes(spoilt) + data[2])
        assert [block.sequence for block in found] == [0, 2], at
        assert len(problems) == 1, at
    for rubbish in (b"\xff" * 5000, b"\0" * 4096, b"t_s,ax_g\n0.0,1.0\n", data[0][:2000]):
        found, problems = block_reader.read(rubbish + data[2])
        assert [block.sequence for block in found] == [2]
        assert len(problems) == 1
    assert block_reader.read(b"") == ([], [])


def sealed(data):
    """Add a valid check sum to these bytes, as an attacker would."""
    return data[:-4] + struct.pack("<I", crc32(data[:-4]))


def test_a_block_with_impossible_values_is_bad(tmp_path):
    """Every block that the reader accepts can be written as a log and shown live, because the reader rejects impossible
    values."""
    good = ride_writer.blocks(1, speed=True, places_every=50)[0][0]
    head = struct.calcsize(block_format.HEAD)
    start = head + store.BODY_LENGTH
    forged = []
    fields = struct.unpack_from(block_format.HEAD, good)
    for i in (7, 8, 9):  # fields 7 to 9 are the units of force and rate, and the samples per second
        forged.append(struct.pack(block_format.HEAD, *fields[:i], 0, *fields[i + 1 :]) + good[head:])
    for value in (math.nan, math.inf, 1e38):
        at = start - 4 * len(ride_writer.calibration().parameters())
        forged += [good[:k] + struct.pack("<f", value) + good[k + 4 :] for k in range(at, start, 4)]
    for data in forged:
        with pytest.raises(block_reader.BadBlock, match="not decodable"):
            block_reader.parse(sealed(data))
    chance, taken = random.Random(1), 0
    for _ in range(200):
        data = bytearray(good)
        for _ in range(chance.choice((1, 4, 40))):
            data[chance.randrange(head, len(data) - 4)] = chance.choice((0, 255, chance.randrange(256)))
        try:
            block = block_reader.parse(sealed(bytes(data)))
        except block_reader.BadBlock:
            continue
        taken += 1
        ride_log.write(tmp_path / "ride.csv", [block])
        stream.StreamLog(threading.Event(), lambda reading: None).write(io.StringIO(), iter([block]), [])
    assert taken > 10
