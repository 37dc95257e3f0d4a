"""Encodes the packets for a phone, and decodes the phone's requests. firmware/docs/live.md describes their bytes.

An unknown value is never sent as a plausible number. RaceChrono then gets no packet, and our own page gets UNKNOWN.
"""

from math import floor
from struct import pack_into, unpack_from

from ..units import const

VERSION = 1  # version of Kickstand's own packets
# Kinds of packets, which are also the indices in `intervals`. RaceChrono's packet ids are higher by 1
LEAN, MOTION, SPEED, OWN = range(4)
_FASTEST_MS = const(40)  # packets of the same kind are at least this far apart
UNKNOWN, UNKNOWN_SPEED, UNKNOWN_SIGMA = -0x8000, 0xFFFF, 0xFF

ALIGNED, TRUSTED, AT_REST, FALLEN, RECORDING, CAR, NO_READINGS = (1 << bit for bit in range(7))  # bits of the state


def whole(value, scale, low=-0x7FFF, high=0x7FFF):
    """Return the value in units of 1 / scale, rounded and limited to the range from low to high."""
    return max(low, min(high, floor(scale * value + 0.5)))


def _sigma(sigma_deg):
    return whole(sigma_deg, 10, 0, 0xFE)


def lean(buffer, lean_deg, sigma_deg):
    """Write RaceChrono's packet 1 into the buffer. Return its length."""
    pack_into("<IhB", buffer, 0, LEAN + 1, whole(lean_deg, 10), _sigma(sigma_deg))
    return 7


def motion(buffer, force, rate_dps, trusted):
    """Write RaceChrono's packet 2 into the buffer. Return its length.

    Args:
        force: force to the left, up and forward, in g.
        rate_dps: rate about left, up and forward, in deg/s.
        trusted: True if the lean can be trusted.
    """
    pack_into("<I", buffer, 0, MOTION + 1)
    forces = whole(force[2], 1000), whole(force[0], 1000), whole(force[1], 1000)
    pack_into("<5hB", buffer, 4, *forces, whole(rate_dps[1], 10), whole(rate_dps[2], 10), trusted)
    return 15


def speed(buffer, speed_mps):
    """Write RaceChrono's packet 3 into the buffer. Return its length."""
    pack_into("<IH", buffer, 0, SPEED + 1, whole(speed_mps, 100, 0, 0xFFFE))
    return 6


def now(buffer, ms, lean_deg, sigma_deg, force, rate_dps, speed_mps, state):
    """Write our own packet with the current values into the buffer. Return its length.

    Args:
        ms: ticks_ms().
        lean_deg, sigma_deg: the lean and its standard deviation; both None if unknown.
        force: force to the left, up and forward, in g, or None.
        rate_dps: rate about left, up and forward, in deg/s. The rate is not sent if force is None.
        speed_mps: the speed, or None.
        state: the bits ALIGNED to NO_READINGS.
    """
    is_known = lean_deg is not None
    tilt = (whole(lean_deg, 100), _sigma(sigma_deg)) if is_known else (UNKNOWN, UNKNOWN_SIGMA)
    pack_into("<HhB", buffer, 0, ms & 0xFFFF, *tilt)
    for i in range(3):
        pack_into("<h", buffer, 5 + 2 * i, UNKNOWN if force is None else whole(force[i], 2048))
        pack_into("<h", buffer, 11 + 2 * i, UNKNOWN if force is None else whole(rate_dps[i], 16))
    pack_into("<HB", buffer, 17, UNKNOWN_SPEED if speed_mps is None else whole(speed_mps, 100, 0, 0xFFFE), state)
    return 20


def ride(buffer, state, meter, lost):
    """Write our own packet with the values of the ride so far into the buffer. Return its length.

    Args:
        state: the bits ALIGNED to NO_READINGS.
        meter: a LeanMeter.
        lost: number of lost samples.
    """
    leans = whole(meter.max_left_deg, 10), whole(meter.max_right_deg, 10)
    peaks = whole(meter.max_accel_g, 1000), whole(meter.max_brake_g, 1000)
    pack_into("<BB4HhH", buffer, 0, VERSION, state, *leans, *peaks, whole(meter.trim_deg, 100), min(lost, 0xFFFF))
    return 14


def _interval(data, start, form):
    return max(_FASTEST_MS, unpack_from(form, data, start)[0])


FILTER_LENGTHS = {0: 1, 1: 3, 2: 7}  # first byte of a command to RaceChrono's filter: bytes of the command


def take_filter(data, intervals):
    """Execute a command that RaceChrono has written to its filter.

    Args:
        data: the bytes of the command.
        intervals: list of the milliseconds between two packets of each kind; 0 if no packets are requested. The
            function updates it.

    Returns:
        False if the bytes are not one of RaceChrono's commands.
    """
    command = bytes(data[:1]), len(data)
    if command == (b"\x00", 1):
        intervals[LEAN] = intervals[MOTION] = intervals[SPEED] = 0
    elif command == (b"\x01", 3):
        intervals[LEAN] = intervals[MOTION] = intervals[SPEED] = _interval(data, 1, ">H")
    elif command == (b"\x02", 7):
        packet = unpack_from(">I", data, 3)[0]
        if 0 < packet <= SPEED + 1:
            intervals[packet - 1] = _interval(data, 1, ">H")
    else:
        return False
    return True


def take_rate(data, intervals):
    """Execute a command of our own page. The command has the milliseconds between two packets, or 0 for no packets.

    The arguments are those of take_filter(). Return False if the bytes are not a command."""
    if len(data) != 2:
        return False
    intervals[OWN] = _interval(data, 0, "<H") if data[0] or data[1] else 0
    return True
