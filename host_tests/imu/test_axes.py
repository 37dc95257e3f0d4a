"""The driver finds faulty axes by their counts, and never reports a good axis. A look is 0.4 s of samples."""

import sys
from array import array

import numpy as np
import pytest
from kickstand.imu.axes import DUE, LOOK_MS, AxisWatch, add_up

RATE_HZ = 200
LOOK = RATE_HZ * LOOK_MS // 1000  # samples
REST = (0, 0, 4096, -3920, 10, -500, 300)  # counts of a chip at rest, in the ranges of 8 g and 500 deg/s
NOISE = (13, 13, 13, 3, 2.66, 2.66, 2.66)  # rms of the noise in counts, by the data sheet at DLPF 3


class Judged:
    """An AxisWatch that is fed with samples, and what it says after each look."""

    def __init__(self, gyro_range=1, dlpf=3, accel_range=3):
        self.watch = AxisWatch(RATE_HZ, accel_range, gyro_range, dlpf, 20)
        self.looks = []  # (fault, notice, True if the chip should be set up), each text or None
        self._sums = array("i", [0] * 7)

    def feed(self, samples):
        for sample in np.clip(np.round(samples), -32768, 32767).astype(">i2"):
            add_up(bytearray(sample.tobytes()), 1, self._sums, self.watch.notes)
            if self.watch.notes[DUE] <= 0:
                setup = self.watch.look()
                self.looks.append((words(self.watch.fault), words(self.watch.notice), setup))
                self.watch.notice = None
        return self

    def changes(self):
        """Return (time in s, fault) of each change of the fault."""
        faults = [None, *(fault for fault, _, _ in self.looks)]
        return [(k * LOOK / RATE_HZ, faults[k]) for k in range(1, len(faults)) if faults[k] != faults[k - 1]]


def words(notice):
    return notice and " ".join(notice.values)


def filtered(rng, count, bandwidth_hz):
    """Return noise with an rms of 1 after a first-order low-pass."""
    pole = np.exp(-2 * np.pi * bandwidth_hz / RATE_HZ)
    white = rng.normal(size=count + 50) * np.sqrt(1 - pole * pole)
    out = np.zeros(count + 50)
    for i in range(1, count + 50):
        out[i] = pole * out[i - 1] + white[i]
    return out[50:]


def at_rest(seconds, seed=0, noise=NOISE, bandwidth_hz=42, rest=REST):
    """Return samples of a chip at rest in counts, shape (n, 7)."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE_HZ)
    return np.stack([mean + rms * filtered(rng, n, bandwidth_hz) for mean, rms in zip(rest, noise)], axis=1)


def ride(seconds, seed=0):
    """Return samples of a ride with leans, engine vibration and bumps."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    rng = np.random.default_rng(seed)
    samples = at_rest(seconds, seed)
    for column, size in ((0, 400), (1, 300), (2, 900), (4, 1200), (5, 800), (6, 300)):
        samples[:, column] += size * np.sin(t * rng.uniform(0.5, 2.0) + column) + 0.1 * size * np.sin(t * 210 + column)
    return samples


@pytest.mark.parametrize(
    ("fault", "columns", "spoil"),
    [
        ("Gyro x dead", 4, lambda counts: 0 * counts),
        ("Gyro y dead", 5, lambda counts: 0 * counts - 1),
        ("Gyro xyz dead", slice(4, 7), lambda counts: 0 * counts + 9),
        ("Accel z stuck", 2, lambda counts: 0 * counts + 4096),
        ("Accel xyz stuck", slice(0, 3), lambda counts: 0 * counts + 55),
        ("Gyro z dead", [2, 6], lambda counts: 0 * counts + 4),  # the gyro is named before the accelerometer
        ("Gyro y dead", 5, lambda counts: np.where(np.arange(len(counts)) % 3 == 0, -700, 900)),
        ("Gyro z dead", 6, lambda counts: counts & ~0xFF | 0x40),  # the low byte is stuck
        ("Gyro x dead", 4, lambda counts: counts & ~1),  # the lowest bit is stuck
        ("Gyro x dead", 4, lambda counts: counts | 1),
        ("Gyro x dead", 4, lambda counts: counts & 0xFF),  # the high byte is stuck
        ("Accel y stuck", 1, lambda counts: (counts & 0xFF) - 256),
        ("Gyro xy equal", slice(4, 6), lambda counts: counts[:, [1, 1]]),
        ("Gyro xz equal", [4, 6], lambda counts: counts[:, [0, 0]]),
        ("Accel yz equal", slice(1, 3), lambda counts: counts[:, [1, 1]]),
        ("Accel xz equal", [0, 2], lambda counts: counts[:, [1, 1]]),
    ],
)
def test_a_faulty_axis_is_reported_within_1_2_s_and_recovers(fault, columns, spoil):
    """The fault lasts from 2 to 5 s. A stuck high byte may take longer, because it shows only when the counts leave its
    range."""
    samples = np.round(ride(8)).astype(int)
    samples[2 * RATE_HZ : 5 * RATE_HZ, columns] = spoil(samples[2 * RATE_HZ : 5 * RATE_HZ, columns])
    (begin_s, words), (end_s, last) = Judged().feed(samples).changes()
    assert (words, last) == (fault, None)
    assert 2.3 < begin_s <= 3.7 and 5.3 < end_s <= 6.5


@pytest.mark.parametrize("gyro_range", [0, 3])
@pytest.mark.parametrize(("dlpf", "bandwidth_hz"), [(1, 188), (2, 98), (3, 42), (4, 20), (5, 10), (6, 5)])
def test_the_quietest_chip_at_rest_is_not_faulty(gyro_range, dlpf, bandwidth_hz):
    """The chip has little noise, 100 ug/sqrt(Hz) and 0.004 deg/s/sqrt(Hz), and the accelerometer's range is 16 g. The
    counts then change as little as they can."""
    root = np.sqrt(np.pi / 2 * bandwidth_hz)
    noise = [100e-6 * root * 2048] * 3 + [3] + [0.004 * root * (131, 65.5, 32.8, 16.4)[gyro_range]] * 3
    resting = (0.0, 0.5, 2048.5, -3920, 0.0, -500.5, 0.5)
    assert Judged(gyro_range, dlpf).feed(at_rest(10, dlpf, noise, bandwidth_hz, resting)).changes() == []


def test_in_a_ride_the_judge_is_not_even_imported(monkeypatch):
    """The missing import saves 2 KB of heap."""
    monkeypatch.delitem(sys.modules, "kickstand.imu.axis_judge", raising=False)
    for seed in range(4):
        assert Judged().feed(ride(20, seed)).changes() == []
    assert "kickstand.imu.axis_judge" not in sys.modules


def one_look(column=None, values=(), clipped=0, gyro_clipped=0, end=(1,), shaken=0):
    """Return the samples of one look. Each good axis has many values, changes its high byte, and differs from the
    others. `values` replace those of a column in turn. The first `clipped` samples are at the end of the range on the
    axes `end`, the first gyro_clipped also on gyro y, and `shaken` samples reach half of the range."""
    k = np.arange(LOOK)
    samples = np.stack([(37 + 10 * i) * ((k + 3 * i) % 17) - 255 for i in range(7)], axis=1)
    if column is not None:
        samples[:, column] = np.resize(values, LOOK)
    for axis in end:
        samples[:clipped, axis] = 32767
    samples[:gyro_clipped, 5] = -32768
    samples[LOOK - shaken :, 0] = 16384 + k[:shaken] % 9
    return samples


@pytest.mark.parametrize(
    ("share", "notice", "fault"),
    [
        ({"clipped": 7}, None, None),
        ({"clipped": 8}, "Accel", None),
        ({"clipped": 8, "gyro_clipped": 4}, "Gyro", None),
        ({"clipped": 8, "gyro_clipped": 3}, "Accel", None),
        ({"clipped": 39}, "Accel", None),
        ({"clipped": 40}, "Accel", "Accel"),
        ({"shaken": 7}, None, None),
        ({"shaken": 8}, "Accel", "Accel"),
    ],
)
def test_samples_at_the_end_of_the_range_clip(share, notice, fault):
    """A notice appears if a tenth of the samples clip. A fault is reported if half of the samples clip in two looks, or
    if the sensor is shaken in two looks. In a range of 4 g nothing counts as shaken."""
    judged = Judged(accel_range=3 if "shaken" in share else 1).feed(np.vstack([one_look(**share)] * 2))
    assert judged.looks == [(None, notice, False), (fault, None, False)]
