"""Models a GPS receiver that sends NMEA sentences on a serial line, some time after each fix."""

_KNOTS = 3600.0 / 1852.0
_PIECE = 8  # number of bytes that are delivered at once
_START_S = 12 * 3600 - 20  # the board's clock is 0 at this time of day, in s UTC, on 21 November 2026
_HOME = 48.1173, 11.5166667  # degrees north and east


def _angle(degrees, digits, sides):
    """Return an angle as NMEA writes it: degrees with `digits` digits, minutes, and the letter of its side."""
    parts = int(abs(degrees) * 6e6 + 0.5)  # the angle in units of 0.00001 minutes
    whole, remainder = parts // 6_000_000, parts % 6_000_000
    side = sides[1] if degrees < 0.0 else sides[0]
    return "%0*d%02d.%05d,%s" % (digits, whole, remainder // 100_000, remainder % 100_000, side)


def sentence(body):
    """Return a whole NMEA line with $, body, checksum and line end."""
    total = 0
    for byte in body.encode():
        total ^= byte
    return "$%s*%02X\r\n" % (body, total)


class Gps:
    """A GPS receiver, which transmits on clock events.

    speed: function speed(t_s) that returns the speed of the vehicle in m/s.
    hz: fixes per second.
    latency_s: time from a fix to its first byte.
    place: function place(t_s) that returns latitude and longitude in degrees north and east. None: a fixed position.
    kinds: the sentences to send. Each contains a speed.
    talker: first letters of the sentences, which name the satellite system.
    faults: [[kind, from_s, until_s], ...]. The kinds are "unplugged", "garbled" (occasional wrong bits), "void" (no
        fix) and "stuck" (the receiver repeats the last sentence).
    """

    def __init__(
        self, clock, speed, hz=1, latency_s=0.2, baud=9600, talker="GP", kinds=("RMC", "VTG"), faults=(), place=None
    ):
        self._clock = clock
        self._speed = speed
        self._latency_us = int(latency_s * 1e6)
        self.baud = baud
        self._talker = talker
        self._kinds = kinds
        self._faults = faults
        self._place = place
        self._last = b""
        self._sent = 0
        self._receive = None
        clock.every(1_000_000 // hz, self._fix)

    def connect(self, receive):
        """Call receive(bytes) with the bytes sent from now on. None: the bytes are lost."""
        self._receive = receive

    def _has(self, kind):
        t_s = self._clock.now_us / 1e6
        return any(name == kind and begin_s <= t_s < end_s for name, begin_s, end_s in self._faults)

    def _fix(self):
        if not self._has("stuck"):
            self._last = self._sentences().encode()
        data = bytearray(self._last)
        if self._has("garbled"):
            for i in range(self._sent % 13, len(data), 13):
                # Invert different bits, because the same bit in two bytes would not change the checksum
                data[i] ^= 1 << (self._sent + i // 13) % 7
        self._sent += 1
        start_us = self._clock.now_us + self._latency_us
        for i in range(0, len(data), _PIECE):
            piece = bytes(data[i : i + _PIECE])
            self._clock.at(start_us + (i + len(piece)) * 10_000_000 // self.baud, self._sender(piece))

    def _sender(self, piece):
        def send():
            if self._receive and not self._has("unplugged"):
                self._receive(piece)

        return send

    def _sentences(self):
        now_us = self._clock.now_us
        knots = self._speed(now_us / 1e6) * _KNOTS
        seconds = now_us // 1_000_000 + _START_S
        day, seconds = 21 + seconds // 86400, seconds % 86400
        time = "%02d%02d%02d.%02d" % (seconds // 3600, seconds // 60 % 60, seconds % 60, now_us // 10_000 % 100)
        valid = not self._has("void")
        text = ""
        if "RMC" in self._kinds:
            lat, lon = self._place(now_us / 1e6) if self._place else _HOME
            fix = "A,%s,%s,%.3f,84.4" % (_angle(lat, 2, "NS"), _angle(lon, 3, "EW"), knots) if valid else "V,,,,,,"
            text += sentence("%sRMC,%s,%s,%02d1126,,,%s" % (self._talker, time, fix, day, "A" if valid else "N"))
        text += sentence("%sGSA,A,3,04,05,,09,12,,,24,,,,,2.5,1.3,2.1" % self._talker)
        if "VTG" in self._kinds:
            course = "84.4,T,,M,%.3f,N,%.3f,K,A" % (knots, knots * 1.852) if valid else ",,,,,,,,N"
            text += sentence("%sVTG,%s" % (self._talker, course))
        return text
