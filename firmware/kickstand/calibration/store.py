"""Stores the calibration in flash. Two files are written alternately, so one file is still valid after a power cut.

Each file holds a record with these parts:
* magic, version, length, sequence number
* the chip's WHO_AM_I and range, flags
* 19 floats; version 2 adds 27 floats for the matrices
* the CRC32 of everything before it

A calibration without matrices is written as version 1, because all releases of the firmware read version 1. load() uses
the newest valid record. save() overwrites the other record and reads it back. A failed read never causes a write,
because a good file can read as empty while the voltage sags.
"""

import struct
from binascii import crc32
from errno import ENOENT

from ..errors import Refusal
from ..rotation import matrix
from ..units import const
from .parameters import MAX_GYRO_SIGMA, MAX_MATRIX_ERROR, MAX_OFFSET_G, MAX_SLOPE, MIN_SLOPE, Calibration

FILES = ("kickstand_a.cal", "kickstand_b.cal")
_VERSION = const(1)
_WHOLE_VERSION = const(2)  # version of a record with the matrices
_MAGIC = b"KSTD"
_HEAD = "<4sHHI"  # magic, version, length of the whole record in bytes, sequence number
_BODY = "<BBBB19f"  # who_am_i, accelerometer range in g, six_done, how aligned; 19 numbers of Calibration.parameters()
_NOT_ALIGNED, _BY_POSES, _BY_DRIVE = 0, 1, 2  # the values of "how aligned"
_WHOLE = "<27f"  # accel_matrix, gyro_matrix, gyro_sigma
BODY_LENGTH = struct.calcsize(_BODY)
WHOLE_BODY_LENGTH = BODY_LENGTH + struct.calcsize(_WHOLE)
_HEAD_LENGTH = struct.calcsize(_HEAD)
_LENGTHS = {_VERSION: _HEAD_LENGTH + BODY_LENGTH + 4, _WHOLE_VERSION: _HEAD_LENGTH + WHOLE_BODY_LENGTH + 4}
MAX_BIAS_DPS = 60.0  # largest plausible bias of the gyro
MAX_TRIM_DEG = 3.6  # MAX_TRIM of lean/kalman.py in degrees, plus a margin for 32-bit rounding


class Store:
    """Reads and writes the calibration records of one chip.

    Args:
        who_am_i: WHO_AM_I of the chip in use. Records of another chip are invalid.
        accel_range_g: accelerometer range of the chip in use. Records of another range are valid, because offset and
            slope hardly depend on the range.
        directory: the directory of the files, "" for the current one.
        newest: the attribute of an earlier Store of this chip, or None.

    Attributes:
        message: after load(), a few words about the record in use, or the reason why no record is valid.
        newest: the sequence number of the record in use, 0 without a record, and the faults of the invalid records in
            words.
    """

    def __init__(self, who_am_i, accel_range_g, directory="", newest=None):
        self.who_am_i = who_am_i
        self._chip = (who_am_i, accel_range_g)
        self._directory = directory + "/" if directory else ""
        self.message = ""
        self.newest = newest or (0, [])

    def load(self):
        """Return the newest valid Calibration, or a default Calibration if no record is valid. Raises nothing and
        writes nothing."""
        sequence, calibration, problems = self._newest()
        self.newest = sequence, problems
        if calibration is None:
            self.message = "not calibrated" + (": " + ", ".join(problems) if problems else "")
            return Calibration()
        self.message = "record %d" % sequence + (" (other record: %s)" % ", ".join(problems) if problems else "")
        return calibration

    def unchanged(self):
        """Return True if both files read the same as in load() or save().

        If the files read differently, a file was misread, for example in a voltage sag. After a misread the loaded
        record may be the older of the two, and the newer record must not be overwritten."""
        sequence, _, problems = self._newest()
        return (sequence, problems) == self.newest

    def save(self, calibration):
        """Write a Calibration over the older record and read it back. The record in use is never damaged. Raises
        Refusal."""
        sequence, _, _ = self._newest()
        version = _WHOLE_VERSION if calibration.whole else _VERSION
        record = struct.pack(_HEAD, _MAGIC, version, _LENGTHS[version], sequence + 1) + pack(*self._chip, calibration)
        record += struct.pack("<I", crc32(record))
        path = self._directory + FILES[(sequence + 1) % 2]
        try:
            with open(path, "wb") as file:
                file.write(record)
            with open(path, "rb") as file:
                written = file.read()
        except OSError as error:
            raise Refusal("not-written", str(error))
        if written != record:
            raise Refusal("read-back")
        sequence, _, problems = self._newest()
        self.newest = sequence, problems

    def _newest(self):
        """Find the newest valid record.

        Returns:
            sequence: its sequence number, or 0 if no record is valid.
            calibration: its Calibration, or None if no record is valid.
            problems: list of the faults of the invalid records, in words.
        """
        newest, calibration, problems = 0, None, []
        for name in FILES:
            try:
                with open(self._directory + name, "rb") as file:
                    sequence, values = self._unpack(file.read(_LENGTHS[_WHOLE_VERSION] + 1))
                if sequence > newest:
                    newest, calibration = sequence, values
            except OSError as error:
                if error.args[0] != ENOENT:  # a missing file is no problem, because save() creates it
                    problems.append("%s unreadable" % name)
            except ValueError as error:
                problems.append("%s %s" % (name, error))
        return newest, calibration, problems

    def _unpack(self, record):
        """Return the sequence number and the Calibration of a record. Raises ValueError with the fault in words."""
        if len(record) not in _LENGTHS.values():
            complete = len(record) >= 6 and record[4] == _WHOLE_VERSION
            length = _LENGTHS[_WHOLE_VERSION if complete else _VERSION]
            raise ValueError("empty" if not record else "cut short" if len(record) < length else "too long")
        magic, version, length, sequence = struct.unpack_from(_HEAD, record, 0)
        if struct.unpack_from("<I", record, len(record) - 4)[0] != crc32(record[:-4]):
            raise ValueError("damaged")
        if magic != _MAGIC or length != len(record) or _LENGTHS.get(version) != length or sequence == 0:
            raise ValueError("of another version")
        who_am_i, _, calibration = unpack(record[_HEAD_LENGTH:-4])
        if who_am_i != self.who_am_i:
            raise ValueError("of another sensor")
        if not plausible(calibration):
            raise ValueError("out of range")
        return sequence, calibration


def pack(who_am_i, accel_range_g, calibration):
    """Pack a Calibration and its chip into bytes.

    Args:
        who_am_i: WHO_AM_I of the chip.
        accel_range_g: accelerometer range of the chip, an integer.
        calibration: the Calibration.

    Returns:
        BODY_LENGTH bytes, or WHOLE_BODY_LENGTH bytes with matrices.
    """
    method = (_BY_DRIVE if calibration.by_drive else _BY_POSES) if calibration.aligned else _NOT_ALIGNED
    body = struct.pack(_BODY, who_am_i, accel_range_g, calibration.six_done, method, *calibration.parameters())
    return body + struct.pack(_WHOLE, *calibration.matrices()) if calibration.whole else body


def unpack(data):
    """Return (who_am_i, accel_range_g, Calibration) from the bytes of pack()."""
    fields = struct.unpack_from(_BODY, data, 0)
    calibration = Calibration()
    calibration.six_done, calibration.aligned = bool(fields[2]), fields[3] != _NOT_ALIGNED
    calibration.by_drive = fields[3] == _BY_DRIVE
    calibration.set_parameters(fields[4:])
    if len(data) == WHOLE_BODY_LENGTH:
        calibration.set_matrices(struct.unpack_from(_WHOLE, data, BODY_LENGTH))
    return fields[0], fields[1], calibration


def plausible(calibration):
    """Return True if all parameters of the Calibration are within the limits of a real sensor."""
    errors = [calibration.accel_matrix[i] - one for i, one in enumerate(matrix())]
    errors += [calibration.gyro_matrix[i] - one for i, one in enumerate(matrix())]
    return (  # each comparison also rejects NaN
        all(abs(value) < MAX_OFFSET_G for value in calibration.accel_offset)
        and all(MIN_SLOPE < value < MAX_SLOPE for value in calibration.accel_slope)
        and all(abs(value) < MAX_BIAS_DPS for value in calibration.gyro_bias)
        and all(abs(value) <= MAX_MATRIX_ERROR for value in errors)
        and all(0.0 <= value <= MAX_GYRO_SIGMA for value in calibration.gyro_sigma)
        and is_rotation(calibration.vehicle_from_sensor, 1e-4)
        and abs(calibration.trim_deg) <= MAX_TRIM_DEG
    )


def is_rotation(m, tolerance=1e-4):
    """Return True if a matrix M is a rotation. Every entry of M M^T - I must be within the tolerance, and the
    determinant must be positive."""
    for i in (0, 3, 6):
        for j in (0, 3, 6):
            product = m[i] * m[j] + m[i + 1] * m[j + 1] + m[i + 2] * m[j + 2]
            if not abs(product - (1.0 if i == j else 0.0)) <= tolerance:  # "not <=" also rejects NaN
                return False
    determinant = (
        m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6])
    )
    return determinant > 0
