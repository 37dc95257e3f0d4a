"""Reads speed and position from a GPS receiver. The receiver sends the sentences RMC and VTG (NMEA 0183) on a UART.

>>> now_ms = time.ticks_ms()
>>> gps = Gps(machine.UART(1, 9600, tx=machine.Pin(8), rx=machine.Pin(9), timeout=0))
>>> speed_mps = gps.poll(now_ms)        # None if there is no new speed
>>> place = gps.place(now_ms)           # None if poll(now_ms) has found no new position

A sentence is a line with these parts:
* $
* two letters for the satellite system, such as GP, GL, GN or BD; all are accepted
* three letters for the kind of sentence
* fields separated by commas
* "*", and a checksum of two hexadecimal digits, the exclusive or of all bytes between $ and *
"""

from array import array
from time import ticks_add, ticks_diff

from ..errors import Notice
from ..units import const

# Longest sentence in bytes. The standard allows 82 bytes, but receivers with many decimals exceed this length.
_MAX_SENTENCE = const(100)
# Most bytes read per pass of the loop. With a pass every 10 ms, this is twice what arrives at 115,200 baud.
_MAX_CHUNK = const(256)
_SILENT_MS = const(3000)  # time without a byte, a sentence or a fix after which fault() reports it
_LATE_MS = const(2000)  # a fix that is older when it arrives gives no speed
_LOOK_MS = const(1500)  # time without a sentence with a speed after which other kinds of sentences are examined
# Age to which older times are limited, because after 6 days ticks_diff() is negative
_CARRY_MS = const(60_000)
_TIME_JUMP_MS = const(5000)  # a fix that seems delayed by more shows that the receiver's clock was corrected
# The delay of a fix is measured against a reference, which is a fix without a delay. If all fixes are late for longer
# than _TIME_JUMP_MS, the receiver has set its clock back. The new reference is then the fix with the smallest delay of
# at least this number of fixes.
_MIN_FIXES_FOR_NEW_REFERENCE = const(4)
_KNOT_MPS = const(1852.0 / 3600.0)  # one knot in m/s
_KMH_MPS = const(1.0 / 3.6)  # one km/h in m/s
_DAY_MS = 86_401_000  # length of a day with a leap second
# Valid years after 2000. A receiver sends an earlier date after a week rollover, or before it knows the date.
_YEARS = (25, 79)
_SPEEDS = (b"RMC", b"VTG")  # sentences with a speed
_POSITIONS = (b"GGA", b"GLL", b"GNS")  # sentences without a speed that are reported before other kinds
_UBX = b"\xb5b"  # the beginning of a u-blox binary message; class, number and a two-byte length follow
_UBX_CLASSES = b"\x01\x02\x05\x06\x0a\x0b\x0d\x10\x13\x21\x27\x28"
_DIGITS = 5  # number of decimals of a minute of arc; the last decimal is 2 cm


class Gps:
    """A GPS receiver.

    Args:
        uart: a machine.UART with a time-out of 0.

    Attributes:
        age_ms: the age of the speed that poll() last returned. The age is the delay of the speed's sentence relative to
            the sentence with the smallest delay.
    """

    def __init__(self, uart):
        self._uart = uart
        self._line = b""  # the part of a sentence that has arrived so far
        self._rest = b""  # what has arrived after the last speed, for the next poll()
        self._heard_ms = None  # ticks_ms() when the receiver last sent any byte
        # ticks_ms() of the last whole sentence, of the last sentence with a fix, and of the last _carry()
        self._sentence_ms = self._fix_ms = self._carried_ms = 0
        self._rmc_ms = None  # ticks_ms() of the last RMC
        self._other = b""  # a received kind of sentence or message without a speed
        self._time = b""  # time of day in the last RMC
        # A fix is stored as the ticks_ms() of the last midnight, which are late by the delay of the fix.
        self._reference_ms = None  # the fix from which the delays of other fixes are counted
        self._earliest_ms = 0  # the fix with the smallest delay since the reference was set
        self._fixes = 0  # number of fixes with a delay since the reference was set
        self._since_ms = 0  # ticks_ms() when the reference was set
        self.age_ms = 0
        self._fix = None  # fields of the RMC with the last speed; None if the speed was from a VTG
        self._day_ms = 0  # the time of day in the RMC with the last speed, in ms
        self._place = array("i", (0, 0, 0, 0))

    def poll(self, now_ms):
        """Return a new speed in m/s, or None. Never waits. now_ms: ticks_ms()."""
        heard_ms = self._heard_ms
        if heard_ms is None:
            self._begin(now_ms)
        elif ticks_diff(now_ms, self._carried_ms) > _CARRY_MS:
            self._carry(now_ms)
        waiting = self._uart.any()
        if not (waiting or self._rest):
            return None
        if heard_ms is not None and ticks_diff(now_ms, heard_ms) > _SILENT_MS:
            self._begin(now_ms)
        self._heard_ms = now_ms
        chunk = self._uart.read(min(waiting, _MAX_CHUNK - len(self._rest))) or b""
        if self._rest:
            chunk, self._rest = self._rest + chunk, b""
        looks = ticks_diff(now_ms, self._sentence_ms) > _LOOK_MS
        if looks and _has_ubx(self._line + chunk):
            self._other = self._other or b"UBX"
        begin, end = 0, chunk.find(b"\n")
        while end >= 0:
            # A whole sentence of another kind is skipped here, because with many satellites most sentences are such
            start = chunk.rfind(b"$", begin, end)
            speed = None
            if looks or self._line or chunk[start + 3 : start + 6] in _SPEEDS:
                speed = self._sentence(self._line + chunk[begin:end], now_ms)
            self._line = b""
            begin = end + 1
            if speed is not None:
                self._rest = chunk[begin:]
                return speed
            end = chunk.find(b"\n", begin)
        self._line += chunk[begin:]
        beyond = len(self._line) - _MAX_SENTENCE
        if beyond > 0:  # the end of a line was lost, so keep only bytes that may begin the next line
            self._line = self._line[max(beyond, self._line.rfind(b"$")) :]
        return None

    def _begin(self, now_ms):
        """Restart the time-outs."""
        self._heard_ms = self._sentence_ms = self._fix_ms = self._carried_ms = now_ms
        self._fix = None
        self._other = b""

    def _carry(self, now_ms):
        """Replace times older than _CARRY_MS by times of that age."""
        self._carried_ms = now_ms
        oldest_ms = ticks_add(now_ms, -_CARRY_MS)
        for name in ("_heard_ms", "_sentence_ms", "_fix_ms", "_rmc_ms"):
            then_ms = getattr(self, name)
            if then_ms is not None and ticks_diff(oldest_ms, then_ms) > 0:
                setattr(self, name, oldest_ms)

    def place(self, now_ms):
        """Return the position of the fix whose speed poll(now_ms) has returned, or None.

        The next position overwrites the array. The numbers are integers, because 32-bit floats do not resolve a metre.

        Returns:
            date: (year since 2000) << 9 | month << 5 | day, or 0 if the receiver does not know the date yet.
            time: time of day in ms.
            latitude: in 0.00001 minutes, positive to the north.
            longitude: in 0.00001 minutes, positive to the east.
        """
        fields = self._fix
        if fields is None or now_ms != self._fix_ms:
            return None
        lat, lon = _minutes(fields[3], 90, fields[4] == b"S"), _minutes(fields[5], 180, fields[6] == b"W")
        if lat is None or lon is None:
            return None
        position = self._place
        position[0] = _date(fields[9]) if len(fields) > 9 else 0
        position[1] = self._day_ms
        position[2] = lat
        position[3] = lon
        return position

    def after_stall(self, now_ms):
        """Do nothing. If bytes were lost while interrupts were off, the checksum of their sentence is wrong."""

    def fault(self, now_ms):
        """Return a Notice with the reason why there is no speed, or None."""
        if self._heard_ms is None:
            return None
        if ticks_diff(now_ms, self._heard_ms) > _SILENT_MS:
            return Notice("gps-silent")
        if ticks_diff(now_ms, self._sentence_ms) > _SILENT_MS:
            return Notice("gps-other", self._other.decode()) if self._other else Notice("gps-garbled")
        if ticks_diff(now_ms, self._fix_ms) > _SILENT_MS:
            return Notice("gps-no-fix")
        return None

    def _sentence(self, line, now_ms):
        """Return the speed in a line in m/s, or None if the line has no valid speed."""
        start = line.rfind(b"$")  # noise may precede the sentence
        kind = line[start + 3 : start + 6]
        if start < 0 or kind not in _SPEEDS:
            if start >= 0 and ticks_diff(now_ms, self._sentence_ms) > _LOOK_MS:
                self._look_at(line[start:])
            return None
        star = line.rfind(b"*")
        try:
            if _checksum(line, start + 1, star) != int(line[star + 1 : star + 3], 16):
                return None
            fields = line[start:star].split(b",")
            speed = self._rmc(fields, now_ms) if kind == b"RMC" else self._vtg(fields, now_ms)
        except (ValueError, IndexError, OverflowError):  # a number like 1e999 raises OverflowError
            return None
        self._sentence_ms = now_ms
        self._other = b""
        if speed is not None:
            self._fix_ms = now_ms
        return speed

    def _look_at(self, line):
        """Store the kind of a whole sentence without a speed."""
        star = line.rfind(b"*")
        try:
            if star < 6 or _checksum(line, 1, star) != int(line[star + 1 : star + 3], 16):
                return
            name = line[1 : line.find(b",")]
            kind = name if name[:1] == b"P" else name[2:]  # P marks a manufacturer's own sentence, like PUBX
            kind.decode()
        except ValueError:
            return
        if kind and len(kind) <= 5 and self._other not in _POSITIONS:
            self._other = kind

    def _rmc(self, fields, now_ms):
        """Return the speed from the fields of $--RMC,time,A or V,lat,N,lon,E,knots,course,date,variation,E[,mode[,...]]
        or None."""
        self._rmc_ms = now_ms
        repeated = fields[1] == self._time
        self._time = fields[1]
        # Mode E is estimated from the last fix (dead reckoning). Mode N is not valid.
        valid = fields[2] == b"A" and not (len(fields) > 12 and fields[12] in (b"E", b"N"))
        if not valid or repeated or self._set_age(fields[1], now_ms) > _LATE_MS:
            return None
        speed = float(fields[7]) * _KNOT_MPS
        self._fix = fields
        return speed

    def _vtg(self, fields, now_ms):
        """Return the speed from the fields of $--VTG,course,T,course,M,knots,N,km/h,K[,mode], or None. A VTG is ignored
        if the receiver also sends RMC."""
        if self._rmc_ms is not None and ticks_diff(now_ms, self._rmc_ms) < _SILENT_MS:
            return None
        if len(fields) > 9 and fields[9] in (b"E", b"N"):
            return None
        self.age_ms = 0
        self._fix = None
        if fields[6] == b"N" and fields[5]:
            return float(fields[5]) * _KNOT_MPS
        return float(fields[7]) * _KMH_MPS if fields[8] == b"K" and fields[7] else None

    def _set_age(self, time, now_ms):
        """Set age_ms and _day_ms from a fix's time of day, hhmmss.ss. Return age_ms.

        If the receiver has set its clock, the fix also becomes the new reference. A NEO-6M, for example, sets its clock
        back by 3 s when it receives the leap seconds. Raises ValueError if the field is not a time of day."""
        day_ms = (int(time[0:2]) * 60 + int(time[2:4])) * 60_000 + int(float(time[4:]) * 1000.0 + 0.5)
        if not 0 <= day_ms <= _DAY_MS:
            raise ValueError
        self._day_ms = day_ms
        self.age_ms = 0
        midnight_ms = ticks_add(now_ms, -day_ms)
        if self._reference_ms is not None:
            delay_ms = ticks_diff(midnight_ms, self._reference_ms)
            if 0 < delay_ms < _TIME_JUMP_MS:
                self.age_ms = delay_ms
                if not self._fixes or ticks_diff(midnight_ms, self._earliest_ms) <= 0:
                    self._earliest_ms = midnight_ms
                self._fixes += 1
                if self._fixes >= _MIN_FIXES_FOR_NEW_REFERENCE and ticks_diff(now_ms, self._since_ms) > _TIME_JUMP_MS:
                    self._reference_ms, self._fixes, self._since_ms = self._earliest_ms, 0, now_ms
                return delay_ms
        self._reference_ms, self._fixes, self._since_ms = midnight_ms, 0, now_ms
        return 0


def _minutes(field, degrees, negative):
    """Convert an angle in NMEA's form, (d)ddmm.mmmm, to units of 0.00001 minutes.

    More decimals are cut off. Return None if the field is not an angle, or if it exceeds `degrees` degrees."""
    integer, point, part = field.partition(b".")
    part += b"0" * _DIGITS
    if not (point and integer.isdigit() and part.isdigit()):
        return None
    minutes = int(integer)
    if minutes >= 100 * degrees or minutes % 100 >= 60:
        return None
    angle = (minutes // 100 * 60 + minutes % 100) * 100_000 + int(part[:_DIGITS])
    return -angle if negative else angle


def _date(field):
    """Convert a date ddmmyy to the form of place(). Return 0 if the date does not exist or its year is outside
    _YEARS."""
    try:
        date = int(field)
    except ValueError:
        return 0
    year, month, day = date % 100, date // 100 % 100, date // 10_000
    if not (_YEARS[0] <= year <= _YEARS[1] and 1 <= month <= 12 and day >= 1):
        return 0
    days = 30 + (month + month // 8) % 2 if month != 2 else 28 if year % 4 else 29
    return year << 9 | month << 5 | day if day <= days else 0


def _has_ubx(data):
    """Return True if a message of u-blox's binary protocol begins in these bytes."""
    start = data.find(_UBX)
    return 0 <= start <= len(data) - 6 and data[start + 2] in _UBX_CLASSES and data[start + 5] < 4


def _checksum(line, start, end):
    """Return the exclusive or of the bytes from start to end - 1."""
    total = 0
    for i in range(start, end):
        total ^= line[i]
    return total
