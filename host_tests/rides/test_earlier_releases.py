"""Files of earlier releases are read by today's code. The bytes were written by the code of each release itself."""

import os
import re

import numpy as np
import pytest
from kickstand.calibration.store import Store
from kickstand.rides import block as block_format
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.deploy import config_file
from kickstand_tools.rides import ride_log
from support.recordings import ride_writer


def unpacked(text):
    """Return the bytes of a text in hexadecimal, in which [n] stands for n zeros."""
    return bytes.fromhex(re.sub(r"\[(\d+)\]", lambda match: "00" * int(match[1]), text))


# kickstand_a.cal after the second save() of a board with 0.1.0, 0.2.0, 0.3.0 or 0.4.0, which write the same bytes
RECORD_1 = unpacked(
    "4b5354440100600002000000680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707d3f0000803f0000c03f[14]803f[14]803f0000"
    "803f[10]a03f1bf13c9a"
)
# kickstand_a.cal after the second save() of the firmware after 0.4.0, with matrices
RECORD_2 = unpacked(
    "4b5354440200cc0002000000680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707d3f0000803f0000c03f[14]803f[14]803f0000"
    "803f[10]a03f0000803f0ad7233c[4]0ad723bc0000803f[14]803f0000803f0ad7233c[4]0ad723bc0000803f[14]803f0ad7a33c0a"
    "d7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33cfb2297ac"
)
MATRIX = [1.0, 0.01, 0.0, -0.01, 1.0, 0.0, 0.0, 0.0, 1.0]

# A block of three passes of the loop at 200 samples per second, with a speed before the second pass. 0.2.0 writes as
# 0.1.0. The last two are of the firmware after 0.4.0. It gave the third pass a position, and the calibration matrices.
RIDES = {
    "0.1.0": (
        "4b5249440100b00007[7]40420f[5]350c00108f02c800302e312e30[7]680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707d3f0"
        "000803f0000c03f[14]803f[14]803f0000803f[10]a03f020000a3fff8000400008071007ffe00002690002fc8[6]09c4[16]040027"
        "f6b7ca"
    ),
    "0.4.0": (
        "4b5249440100b00007[7]40420f[5]350c00108f02c800302e342e30[6]86680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707d3"
        "f0000803f0000c03f[14]803f[14]803f0000803f[10]a03f020000a3fff8000400008071007ffe00002690002fc8[6]09c4[16]0400"
        "0fd448df"
    ),
    "with positions": (
        "4b5249440100100107[7]40420f[5]350c00108f02c800302e342e30[5]0186680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707"
        "d3f0000803f0000c03f[14]803f[14]803f0000803f[10]a03f020000a3fff8000400008071007ffe00002690002fc8[6]09c4[96]03"
        "00b134dc05000000882a11c07508fe0400878ed11b"
    ),
    "with matrices": (
        "4b5249440200500107[7]40420f[5]350c00108f02c800302e342e30[5]0186680801020ad7233c0ad7a3bc8fc2f53cae47813fa4707"
        "d3f0000803f0000c03f[14]803f[14]803f0000803f[10]a03f0000803f0ad7233c[4]0ad723bc0000803f[14]803f0000803f0ad723"
        "3c[4]0ad723bc0000803f[14]803f0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c0ad7a33c020000a"
        "3fff8000400008071007ffe00002690002fc8[6]09c4[52]0300b134dc05000000882a11c07508fe0400aa9a8369"
    ),
}


def check_calibration(calibration, matrices):
    assert list(calibration.accel_offset) == pytest.approx([0.01, -0.02, 0.03])
    assert list(calibration.accel_slope) == pytest.approx([1.01, 0.99, 1.0])
    assert list(calibration.gyro_bias) == pytest.approx([1.5, 0.0, 0.0])
    assert list(calibration.vehicle_from_sensor) == [0, 1, 0, 0, 0, 1, 1, 0, 0]
    assert (calibration.trim_deg, calibration.aligned, calibration.by_drive, calibration.six_done) == (1.25, 1, 1, 1)
    assert list(calibration.gyro_matrix) == pytest.approx(MATRIX if matrices else np.eye(3).ravel().tolist())


@pytest.mark.parametrize("record", [RECORD_1, RECORD_2])
def test_calibration_in_flash_stays_valid(record, tmp_path):
    (tmp_path / "kickstand_a.cal").write_bytes(record)
    store = Store(0x68, 8, str(tmp_path))
    calibration = store.load()
    assert store.message == "record 2"
    check_calibration(calibration, matrices=record is RECORD_2)
    store.save(calibration)  # the next save writes the other file
    assert (tmp_path / "kickstand_a.cal").read_bytes() == record and len(os.listdir(tmp_path)) == 2


@pytest.mark.parametrize("release", RIDES)
def test_recorded_ride_stays_readable(release, tmp_path):
    (block,), problems = ride_log.read(unpacked(RIDES[release]))
    assert problems == [] and (block.ride, block.sequence, block.time_us) == (7, 0, 1_000_000)
    assert block.firmware == (release if release == "0.1.0" else "0.4.0")
    assert [(turn.time_us, turn.n, turn.speed_mps) for turn in block.turns] == [
        (1_010_000, 2, None), (1_020_001, 2, 12.34), (1_030_003, 2, None),
    ]  # fmt: skip
    assert [turn.sums for turn in block.turns] == [(200 * i, -100, 8192, 4, -4, 8) for i in range(3)]
    check_calibration(block.calibration(), matrices="matrices" in release)
    cal = read_calibration(ride_log.write(tmp_path / "ride.csv", [block]))
    assert cal.gyro_delay_s == (None if release == "0.1.0" else 0.0134)
    position = block.turns[2].place
    assert (position is not None) is release.startswith("with")
    if position:
        assert (position.lat_deg, position.lon_deg, position.utc_s) == (48.0, -5.5, 1_778_976_001.5)


def test_todays_firmware_writes_the_same_bytes(monkeypatch):
    """If you change the bytes that are written, change the format's number and keep the reader of the old format."""
    monkeypatch.setattr(block_format, "__version__", "0.4.0")
    ride = unpacked(RIDES["with positions"])
    (stored,) = ride_log.read(ride)[0]
    block = block_format.RideBlock(5000)
    block.begin(len(ride), 7, 0, 1_000_000, ride_writer.CHIP, 200, stored.body)
    for i in range(3):
        if i == 1:
            block.add_speed(1234)
        if i == 2:
            block.add_place((26 << 9 | 5 << 5 | 17, 1500, 48 * 6_000_000, -33_000_000))
        block.add([200 * i, -100, 8192, 60, 4, -4, 8], 2, 10_000 + i)
    block.close()
    assert bytes(block.buffer[: block.length]) == ride


# The settings of 0.1.0 to 0.4.0, each in use and with another value than the default where a Pico allows one
CONFIG = (
    "SIDE = 'right'; SAMPLE_HZ = 100; ACCEL_RANGE_G = 4; GYRO_RANGE_DPS = 1000; DLPF = 4; "
    "ACCEPT_WHO_AM_I = 0x47; SENSOR_ADDRESS = 0x69; SENSOR_I2C = 0; SENSOR_SDA = 4; SENSOR_SCL = 5; "
    "SENSOR_BUS_HZ = 100_000; LCD_I2C = 1; LCD_SDA = 6; LCD_SCL = 7; LCD_BUS_HZ = 100_000; "
    "LCD_ADDRESSES = (0x26,); BUTTON_PIN = 15; VEHICLE = 'car'; SPEED = 'wheel'; GPS_UART = 1; GPS_RX = 9; "
    "GPS_TX = 8; GPS_BAUD = 38400; WHEEL_PIN = 14; PULSES_PER_METRE = 2.0; WATCHDOG = False; RECORD = True; "
    "SD_SPI = 0; SD_SCK = 18; SD_MOSI = 19; SD_MISO = 16; SD_CS = 17"
)


def test_settings_file_stays_valid(tmp_path):
    (tmp_path / "config.py").write_text(CONFIG.replace("; ", "\n"))
    verdict = config_file.judge(tmp_path / "config.py", "rp2", "Raspberry Pi Pico with RP2040")
    assert verdict == config_file.Judged(None, [])
