"""Invalid videos and invalid readings of a camera cause no internal error, and open no other file."""

import random
import struct
from pathlib import Path

import numpy as np
from kickstand_tools.overlay import gpmf, video
from support.recordings import broken_logs


def item(name, kind, size, count, body):
    return struct.pack(">4scBH", name, kind, size, count) + body + bytes(-len(body) % 4)


def test_mutated_readings_of_a_camera_are_numbers_or_nothing():
    rates = np.arange(30).astype(">i2").tobytes()
    stream = item(b"SCAL", b"s", 2, 1, b"\0\5") + item(b"GYRO", b"s", 6, 10, rates)
    inner = item(b"STRM", b"\0", 1, len(stream), stream)
    packet = item(b"DEVC", b"\0", 1, len(inner), inner)
    assert len(next(iter(gpmf.streams(packet, b"GYRO")))) == 10
    for number in range(500):
        chance = random.Random(number)
        change = chance.choice(
            (broken_logs.flip_bytes, broken_logs.cut_end, broken_logs.cut_a_piece, broken_logs.put_nul_bytes)
        )
        for values in gpmf.streams(change(packet, chance), b"GYRO"):
            assert values.ndim == 2 and values.shape[1] == 3


def test_file_name_is_no_protocol_and_opens_no_network():
    assert video.input_of(Path("12:30.mp4")) == ["-protocol_whitelist", "file,pipe", "-i", "file:12:30.mp4"]
