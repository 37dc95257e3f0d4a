"""The driver finds faulty axes by their counts. A good axis is never reported."""

from array import array

import numpy as np
import pytest
from kickstand.imu.fifo_frames import DUE, AxisWatch, add_up

RATE_HZ = 200
REST = (0, 0, 4096, -3920, 10, -500, 300)  # counts of a chip at rest, in the ranges of 8 g and 500 deg/s
NOISE = (13, 13, 13, 3, 2.66, 2.66, 2.66)  # rms of the noise in counts, by the data sheet at DLPF 3


def filtered(rng, count, bandwidth_hz):
    """Return noise with an rms of 1 after a first-order low-pass."""
    pole = np.exp(-2 * np.pi * bandwidth_hz / RATE_HZ)
    white = rng.normal(size=count + 50) * np.sqrt(1 - pole * pole)
    out = np.zeros(count + 50)
    for i in range(1, count + 50):
        out[i] = pole * out[i - 1] + white[i]
    return out[50:]


def counts(seconds, seed=0, noise=NOISE, bandwidth_hz=42, rest=REST):
    """Return samples of a chip at rest in counts, shape (n, 7)."""
    rng = np.random.default_rng(seed)
    n = int(seconds * RATE_HZ)
    return np.stack([at + of * filtered(rng, n, bandwidth_hz) for at, of in zip(rest, noise, strict=True)], axis=1)


def ride(seconds, seed=0):
    """Return samples of a ride with leans, engine vibration and bumps."""
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    rng = np.random.default_rng(seed)
    samples = counts(seconds, seed)
    for column, size in ((0, 400), (1, 300), (2, 900), (4, 1200), (5, 800), (6, 300)):
        samples[:, column] += size * np.sin(t * rng.uniform(0.5, 2.0) + column) + 0.1 * size * np.sin(t * 210 + column)
    return samples


def judged(samples, gyro_range=1, dlpf=3, accel_range=3):
    """Return the changes of the notice. Each change is a pair of its time in s and the new notice or None."""
    axes = AxisWatch(RATE_HZ, accel_range, gyro_range, dlpf, 20)
    sums = array("i", [0] * 7)
    said: list[tuple[float, str | None]] = [(0.0, None)]
    for k, sample in enumerate(np.clip(np.round(samples), -32768, 32767).astype(">i2")):
        frame = bytearray(sample.tobytes())
        add_up(frame, 1, sums, axes.notes)
        if axes.notes[DUE] <= 0:
            axes.look()
            words = axes.fault and " ".join(axes.fault.values)
            if words != said[-1][1]:
                said.append(((k + 1) / RATE_HZ, words))
    return said[1:]


def stuck(column, value):
    """Return a fault of one column from second 2 to 5. value: a function from the column's samples to the faulty
    readings."""

    def spoil(samples):
        part = samples[2 * RATE_HZ : 5 * RATE_HZ]
        part[:, column] = value(np.round(part[:, column]).astype(int))
        return samples

    return spoil


def copied(column, other):
    def spoil(samples):
        part = samples[2 * RATE_HZ : 5 * RATE_HZ]
        part[:, column] = part[:, other]
        return samples

    return spoil


def toggled(low, high):
    return lambda column: np.where(np.arange(len(column)) % 3 == 0, low, high)


ILL = [  # for each fault: the text of its notice, and the fault
    ("Gyro x dead", stuck(4, lambda column: 0 * column)),
    ("Gyro y dead", stuck(5, lambda column: 0 * column - 1)),
    ("Gyro z dead", stuck(6, lambda column: 0 * column + 317)),
    ("Gyro xyz dead", stuck(slice(4, 7), lambda columns: 0 * columns + 9)),
    ("Accel z stuck", stuck(2, lambda column: 0 * column + 4096)),
    ("Accel xyz stuck", stuck(slice(0, 3), lambda columns: 0 * columns + 55)),
    ("Gyro x dead", stuck(4, toggled(0, -1))),
    ("Gyro y dead", stuck(5, toggled(-700, 900))),
    ("Gyro z dead", stuck(6, lambda column: column & ~0xFF | 0x40)),  # the low byte of gyro z is stuck
    ("Gyro x dead", stuck(4, lambda column: column & ~1)),  # the lowest bit of gyro x is stuck
    ("Gyro xy equal", copied(4, 5)),
    ("Gyro xz equal", copied(6, 4)),
    ("Accel yz equal", copied(1, 2)),
]


HIGH_BYTE = [
    ("Gyro x dead", stuck(4, lambda column: column & 0xFF)),
    ("Accel y stuck", stuck(1, lambda column: (column & 0xFF) - 256)),
]


@pytest.mark.parametrize(("words", "spoil"), ILL + HIGH_BYTE)
def test_a_faulty_axis_is_reported_at_once_and_recovers(words, spoil):
    """A fault is reported within 1.2 s. A stuck high byte may take longer, because it shows only when the counts leave
    its range."""
    said = judged(spoil(ride(8)))
    assert [what for _, what in said] == [words, None]
    assert 2.3 < said[0][0] <= (3.7 if (words, spoil) in HIGH_BYTE else 3.2)
    assert 5.3 < said[1][0] <= 6.5


@pytest.mark.parametrize("gyro_range", range(4))
@pytest.mark.parametrize("dlpf", [1, 2, 3, 4, 5, 6])
def test_the_quietest_chip_at_rest_is_not_faulty(gyro_range, dlpf):
    """The chip has little noise, 100 ug/sqrt(Hz) and 0.004 deg/s/sqrt(Hz), and the accelerometer's range is 16 g. The
    counts then change as little as they can."""
    bandwidth = (None, 188, 98, 42, 20, 10, 5)[dlpf]
    per_g, per_dps = 2048, (131, 65.5, 32.8, 16.4)[gyro_range]
    root = np.sqrt(np.pi / 2 * bandwidth)
    noise = [100e-6 * root * per_g] * 3 + [3] + [0.004 * root * per_dps] * 3
    rest = (0.0, 0.5, 2048.5, -3920, 0.0, -500.5, 0.5)
    assert judged(counts(20, dlpf, noise, bandwidth, rest), gyro_range, dlpf) == []


def test_no_axis_is_faulty_in_a_ride(monkeypatch):
    """In a ride the axes look so good that the driver does not import the module that judges them. The missing import
    saves 2 KB of heap."""
    monkeypatch.setattr(AxisWatch, "_load", lambda watch: pytest.fail("not well"))
    for seed in range(4):
        assert judged(ride(20, seed)) == []


@pytest.mark.parametrize(("column", "value", "words"), [(4, 32767, "Gyro"), (6, -32768, "Gyro"), (1, 32767, "Accel")])
def test_seconds_at_the_end_of_the_range_make_an_axis_faulty(column, value, words):
    samples = ride(10)
    samples[400:1200, column] = value
    (first_s, first), (second_s, second), (_, last) = judged(samples)
    assert (first, last) == (words, None)
    assert second == f"{words} {'xyz'[column % 4]} {'dead' if words == 'Gyro' else 'stuck'}"
    assert first_s <= 2.9 and second_s <= 4.5


def test_single_samples_at_the_end_of_the_range_are_no_fault():
    samples = ride(20)
    samples[np.random.default_rng(1).random(len(samples)) < 0.05, 1] = 32767
    assert judged(samples) == []


@pytest.mark.parametrize(("accel_range", "said"), [(0, 0), (1, 0), (2, 2), (3, 2)])
def test_hard_vibration_clips_unless_the_range_is_small(accel_range, said):
    """For three seconds the vibration reaches half of the range, even after the low-pass. In a range of 8 or 16 g, such
    a vibration clips before the low-pass. In smaller ranges bends may clip too, so no fault is reported."""
    samples = ride(8)
    samples[400:1000, 1] += 17000 * np.sin(np.arange(600) * 2.2)
    assert [words for _, words in judged(samples, accel_range=accel_range)] == ["Accel", None][:said]
