"""Speed from a GPS receiver: its sentences RMC and VTG (NMEA 0183) on a UART.

>>> gps = Gps(machine.UART(1, 9600, tx=machine.Pin(8), rx=machine.Pin(9)))
>>> speed_mps = gps.poll(time.ticks_ms())       # None where there is no new one

A sentence: $, two letters for the system (GP, GL, GN, BD, ...: any will do), its kind, fields, *, the exclusive or of
everything between $ and * as two hexadecimal digits, end of line.
"""

from time import ticks_diff

from ..errors import SpeedFault

MAX_SENTENCE = 100  # the standard says 82; receivers with many decimals go beyond
MAX_CHUNK = 64  # of what waits, each turn: at a turn each 10 ms twice what 10 fixes a second need
SILENT_MS = 3000
LATE_MS = 2000  # a fix that waited in the receiver for longer says nothing about now
TIME_JUMP_MS = 5000  # not late: the receiver has corrected its clock
FIXES = 4  # at least, over more than TIME_JUMP_MS: what all of them are late by, the receiver's clock has gone back
KNOT_MPS = 1852.0 / 3600.0
KMH_MPS = 1.0 / 3.6


class Gps:
    """uart: a machine.UART, its time-out 0. After poll() has returned a speed: age_ms, how old it is known to be beyond
    the receiver's own delay."""

    def __init__(self, uart):
        self._uart = uart
        self._line = b""
        self._heard_ms = None  # when last: anything; a whole sentence; one with a fix; an RMC
        self._sentence_ms = self._fix_ms = 0
        self._rmc_ms = None
        self._time = b""  # of the last RMC
        self._first = None  # (ticks, time of day), ms, of the fix that age is counted from
        self._prompt = None  # the same of the promptest fix after it, its age; how many those are, since when
        self._prompt_age_ms = self._fixes = self._since_ms = 0
        self.age_ms = 0

    def poll(self, now_ms):
        """A new speed in m/s, or None. Never waits. now_ms: ticks_ms()."""
        if self._heard_ms is None:
            self._heard_ms = self._sentence_ms = self._fix_ms = now_ms
        waiting = self._uart.any()
        if not waiting:
            return None
        self._heard_ms = now_ms
        chunk = self._uart.read(min(waiting, MAX_CHUNK)) or b""
        speed = None
        end = chunk.find(b"\n")
        while end >= 0:
            new = self._sentence(self._line + chunk[:end], now_ms)
            if new is not None:
                speed = new
            self._line = b""
            chunk = chunk[end + 1 :]
            end = chunk.find(b"\n")
        self._line += chunk
        beyond = len(self._line) - MAX_SENTENCE
        if beyond > 0:  # the end of a line was lost: perhaps another has begun
            self._line = self._line[max(beyond, self._line.rfind(b"$")) :]
        return speed

    def skip(self, now_ms):
        """Bytes until now may be lost: the check sum tells."""

    def fault(self, now_ms):
        """None, or a SpeedFault: why there is no speed."""
        if self._heard_ms is None:
            return None
        if ticks_diff(now_ms, self._heard_ms) > SILENT_MS:
            return SpeedFault("gps-silent")
        if ticks_diff(now_ms, self._sentence_ms) > SILENT_MS:
            return SpeedFault("gps-garbled")
        if ticks_diff(now_ms, self._fix_ms) > SILENT_MS:
            return SpeedFault("gps-no-fix")
        return None

    def _sentence(self, line, now_ms):
        """The speed in one line; None if it has none to trust."""
        start = line.rfind(b"$")  # noise may stand in front
        kind = line[start + 3 : start + 6]
        if start < 0 or kind not in (b"RMC", b"VTG"):
            return None
        star = line.rfind(b"*")
        try:
            if _checksum(line, start + 1, star) != int(line[star + 1 : star + 3], 16):
                return None
            fields = line[start:star].split(b",")
            speed = self._rmc(fields, now_ms) if kind == b"RMC" else self._vtg(fields, now_ms)
        except (ValueError, IndexError):
            return None
        self._sentence_ms = now_ms
        if speed is not None:
            self._fix_ms = now_ms
        return speed

    def _rmc(self, fields, now_ms):
        """$--RMC,time,A or V,lat,N,lon,E,knots,course,date,variation,E[,mode[,...]]"""
        self._rmc_ms = now_ms
        repeated = fields[1] == self._time
        self._time = fields[1]
        valid = fields[2] == b"A" and not (len(fields) > 12 and fields[12] in (b"E", b"N"))
        # E: no fix, but the last one carried on
        if not valid or repeated or self._late(fields[1], now_ms):
            return None
        return float(fields[7]) * KNOT_MPS

    def _vtg(self, fields, now_ms):
        """$--VTG,course,T,course,M,knots,N,km/h,K[,mode]: for receivers that send no RMC."""
        if self._rmc_ms is not None and ticks_diff(now_ms, self._rmc_ms) < SILENT_MS:
            return None
        if len(fields) > 9 and fields[9] in (b"E", b"N"):
            return None
        self.age_ms = 0
        if fields[6] == b"N" and fields[5]:
            return float(fields[5]) * KNOT_MPS
        return float(fields[7]) * KMH_MPS if fields[8] == b"K" and fields[7] else None

    def _late(self, time, now_ms):
        """True for a fix that comes much later after its time, hhmmss.ss, than the promptest of late. Sets age_ms.

        A NEO-6M's clock goes back by 3 s when it learns of the leap seconds."""
        day_ms = (int(time[0:2]) * 60 + int(time[2:4])) * 60_000 + int(float(time[4:]) * 1000.0 + 0.5)
        self.age_ms = 0
        if self._first is not None:
            first_ms, first_day_ms = self._first
            age_ms = ticks_diff(now_ms, first_ms) - (day_ms - first_day_ms)
            if 0 < age_ms < TIME_JUMP_MS:
                self.age_ms = age_ms
                if not self._fixes or age_ms <= self._prompt_age_ms:
                    self._prompt, self._prompt_age_ms = (now_ms, day_ms), age_ms
                self._fixes += 1
                if self._fixes >= FIXES and ticks_diff(now_ms, self._since_ms) > TIME_JUMP_MS:
                    self._first, self._fixes, self._since_ms = self._prompt, 0, now_ms
                return age_ms > LATE_MS
        self._first, self._fixes, self._since_ms = (now_ms, day_ms), 0, now_ms
        return False


def _checksum(line, start, end):
    total = 0
    for i in range(start, end):
        total ^= line[i]
    return total
