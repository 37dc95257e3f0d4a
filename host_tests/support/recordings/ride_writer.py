"""Rides written by the firmware's own recorder, as in a board's flash."""

import math
import random
import types
from array import array

from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import pack
from kickstand.rides.block import RideBlock, block_length
from kickstand_tools.rides import ride_log

CHIP = types.SimpleNamespace(
    who_am_i=0x68,
    accel_range_g=8,
    accel_lsb_per_g=4096,
    gyro_lsb_per_dps=65.5,
    gyro_delay_s=0.0134,
    counts=[0] * 7,
    temperature_c=lambda _counts: 31.25,
)


def calibration(trim_deg=0.0, aligned=True):
    """Return a plausible calibration in which no value is the default."""
    new = Calibration()
    new.set_accel((0.01, -0.02, 0.03), (1.01, 0.99, 1.0))
    new.gyro_bias[1] = 1.5
    for i, value in enumerate((0, 1, 0, 0, 0, 1, 1, 0, 0)):
        new.vehicle_from_sensor[i] = value
    new.six_done, new.aligned = True, aligned
    new.trim_deg = trim_deg
    return new


def turns(count, seed=0):
    """Yield the passes of the app's loop on a bike that leans from side to side on a rough road.

    Each pass is (sums of the seven readings, n, dt_us). n is the number of samples, and dt_us is the duration of the
    pass.
    """
    random.seed(seed)
    for i in range(count):
        n = random.choice((2, 2, 2, 2, 2, 1, 3, 8))
        sway = math.sin(i / 100)
        means = (300 * sway, 200, 4096, 0, 90, 40 * sway, 600 * math.cos(i / 100))
        sums = [sum(round(random.gauss(m, 40)) for _ in range(n)) for m in means]
        yield sums, n, n * 5000 + random.randint(-200, 200)


def place(k):
    """Return the k-th position of a ride, in the form of Gps.place().

    The positions are 0.1 s apart. The first position is 17.9 s before midnight on New Year's Eve.
    """
    day_ms, date = 86_382_100 + 100 * k, 26 << 9 | 12 << 5 | 31
    if day_ms >= 86_400_000:
        day_ms, date = day_ms - 86_400_000, 27 << 9 | 1 << 5 | 1
    return array("i", (date, day_ms, -203_212_345 + 7 * k, -1_079_999_999 + 11 * k))


def blocks(count, ride=1, length=block_length, speed=False, places_every=0, passes=turns, **calibrated):
    """Return `count` full blocks, and the passes of the loop that they contain, each as (six sums, n, dt_us).

    speed: True for a speed in every hundredth pass. places_every: number of passes between two positions, 0 for no
    positions. passes(count, seed): the passes, see turns(). calibrated: arguments of calibration().
    """
    block = RideBlock(5000)
    body = pack(CHIP.who_am_i, CHIP.accel_range_g, calibration(**calibrated))
    written, pending = [], []
    source, time_us = passes(1_000_000, seed=ride), 2_000_000
    for index in range(count):
        block.begin(length(index), ride, index, time_us, CHIP, 200, body)
        while not block.full():
            sums, n, dt_us = next(source)
            if speed and len(pending) % 100 == 0:
                block.add_speed(len(pending))
            if places_every and len(pending) % places_every == 0:
                block.add_place(place(len(pending) // places_every))
            block.add(sums, n, dt_us)
            time_us += dt_us
            pending.append((tuple(sums[:3] + sums[4:]), n, dt_us))
        block.close()
        written.append(bytes(block.buffer[: block.length]))
    return written, pending


def begun(length, sequence=0, block=None):
    """Return an empty block of ride 1. block: a RideBlock to reuse, or None for a new block."""
    block = block or RideBlock(5000)
    block.begin(length, 1, sequence, 0, CHIP, 200, bytes(80))
    return block


def ended(block):
    """Close the block and return what the tools read from it."""
    block.close()
    return ride_log.parse(bytes(block.buffer[: block.length]))
