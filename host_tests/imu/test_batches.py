"""The samples of one loop pass are added up and transformed together. The sums equal numpy's on CPython and
MicroPython. Machine code and Python give the same results."""

import numpy as np
import pytest
from support import engines

LIMIT = 5
pytestmark = pytest.mark.parametrize("engine", engines.ENGINES)


def frames(samples):
    """Convert samples of seven 16-bit integers to the bytes on the bus."""
    return np.asarray(samples, ">i2").view(np.uint8).reshape(-1, 14).tolist()


def noise(count, seed=0):
    """Return random samples, which are all different."""
    return np.random.default_rng(seed).integers(-32768, 32768, (count, 7))


def added(engine, *runs):
    """Add up the batches of each run. Return per run and batch [number of good frames, sums, good frames, notes]."""
    return engines.run(engine, [("add_up", ([frames(batch) for batch in run], LIMIT)) for run in runs])


def test_frames_are_seven_big_endian_numbers_and_their_sums(engine):
    """The values are random, at the ends of the range, and where the bytes change."""
    edges = [[value] * 7 for value in (-32768, -32767, -1, 0, 1, 255, 256, 16383, 16384, 32766, 32767)]
    samples = np.vstack((noise(5), edges))
    assert engines.run(engine, [("decode", (frames(samples),))]) == [samples.tolist()]
    batches = [noise(0), noise(1), noise(8), np.array([[-32699] * 7, [32699] * 7, [-32699] * 7, [32697] * 7])]
    (answers,) = added(engine, batches)
    assert [answer[:2] for answer in answers] == [[len(batch), batch.sum(axis=0).tolist()] for batch in batches]


@pytest.mark.parametrize("dead", [0, -1])
def test_all_zeros_or_ones_is_a_dead_frame(engine, dead):
    """A frame is dead if all three forces are zero or all bits are one. Only the frames before a dead frame count. A
    frame with zero force or all bits set on only two axes is good."""
    samples, alive, silent = noise(4), noise(1), noise(2)
    samples[2, 0:3] = alive[0, 0:2] = silent[1] = dead
    (answers,) = added(engine, [samples, alive, silent])
    assert [good for good, *_ in answers] == [2, 1, 1] and answers[0][1] == samples[:2].sum(axis=0).tolist()


def test_repeated_readings_are_a_frozen_chip(engine):
    """Repeated readings are counted, also from batch to batch. A change of any byte ends the repetition, except in the
    temperature."""
    still = np.repeat(noise(1), 12, axis=0)
    runs, counts = [[still[:3], still[3:7], still[7:]]], [[3, 2, 0]]
    for column in range(7):
        for bit in 1, 256:
            changed = still.copy()
            changed[4:, column] ^= bit
            runs.append([changed[:3], changed[3:9]])
            counts.append([3, 2 if column == 3 else 6])
    assert [[good for good, *_ in answers] for answers in added(engine, *runs)] == counts


def test_a_sample_at_the_end_of_the_range_is_left_out(engine):
    """A sample is left out if any axis is at an end of its range. The temperature does not matter. The good samples
    move together in the buffer."""
    samples = noise(8) // 2
    samples[2, 1], samples[3, 6], samples[5, 0], samples[5, 4], samples[6, 3] = 32700, -32768, -32700, 32767, 32767
    good = samples[[0, 1, 4, 6, 7]]
    (((count, sums, moved, notes),),) = added(engine, [samples])
    assert (count, sums, moved) == (5, good.sum(axis=0).tolist(), np.ravel(frames(good)).tolist())
    # number of samples left out, number left out in a row at the end, bits of the axes, number of frames at the end of
    # the range, and how many of these in the gyro
    assert notes[3:8] == [3, 0, 0b1010011, 3, 2]
    assert notes[26:33] == np.abs(samples).max(axis=0).tolist()


def test_a_watch_records_the_low_bits_wraps_and_differences(engine):
    """For each axis the watch records the values of the lowest four bits, a change of the high byte, and a jump of the
    low byte. The watch also records which axes differ from each other."""
    samples = np.full((8, 7), 700) + np.arange(7)
    samples[:, 0] = 5, 6, 5, 6, 5, 6, 5, 6  # axis 0 has only two values
    samples[:, 1] = 2, 194, 5, 6, 7, 198, 9, 8  # on axis 1 the low byte jumps, and the high byte stays the same
    samples[:, 2] = -1, 0, 1, 2, 3, 4, 5, 6
    samples[:, 4] = samples[:, 6] = np.arange(8) * 3 - 8
    ((first, last),) = added(engine, [samples[:1], samples])
    assert first[3][12:19] == samples[0].tolist()
    low_bits = [sum(1 << value for value in set((samples[:, column] & 15).tolist())) for column in range(7)]
    assert [marks & 0xFFFF for marks in last[3][19:26]] == low_bits
    assert [marks >> 16 for marks in last[3][19:26]] == [0, 2, 1, 1, 1, 1, 1] and last[3][8] == 0b1101111


def test_integers_are_as_good_as_floats(engine):
    """Integers instead of floats cause errors of at most 0.03 degrees of lean and 0.05 % of a rate. The sum of eight
    samples at the ends of the range does not overflow."""
    rng = np.random.default_rng(2)
    calls = []
    for _ in range(30):
        matrix, n = np.linalg.qr(rng.normal(size=(3, 3)))[0], int(rng.integers(1, 9))
        sums = (rng.integers(-9000, 9000, 7) * n).tolist()
        calls.append((rng.uniform(-0.5, 0.5, 3).tolist(), rng.uniform(0.8, 1.2, 3).tolist(), matrix, sums, n))
    diagonal = [[0.57735] * 3, [0.8165, -0.40825, -0.40825], [0.0, 0.70711, -0.70711]]
    for end in (-32768, 32767):
        calls.append(([0.5] * 3, [1.2] * 3, np.array(diagonal), [8 * end] * 7, 8))
    answers = engines.run(engine, [("transform", (o, s, m.ravel().tolist(), t, n)) for o, s, m, t, n in calls])
    for (offset, slope, matrix, sums, n), (quick, plain) in zip(calls, answers, strict=True):
        mean = np.array(sums) / n
        force = matrix @ (np.array(slope) * mean[:3] / 4096 + offset)
        rate = matrix @ np.radians(mean[4:] / 65.5 - [2.0, 1.0, 0.0])
        assert plain == pytest.approx([*force, *rate], rel=1e-4, abs=1e-4)
        size, turn = float(np.linalg.norm(mean[:3])) / 4096, float(np.linalg.norm(mean[4:])) / 65.5
        assert quick[:3] == pytest.approx(force, abs=4.5e-4 * max(1.0, size))
        assert quick[3:] == pytest.approx(rate, abs=5e-4 * float(np.radians(turn)))
