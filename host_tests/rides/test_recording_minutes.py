"""The recording times in firmware/docs/rides.md, checked with the firmware's own numbers."""

import re
import types
from pathlib import Path

import pytest
from kickstand.rides import flash_ring, ride_paths
from kickstand.rides.flash_ring import RideRing
from support.recordings import ride_writer

PAGE = Path(__file__).resolve().parents[2] / "firmware" / "docs" / "rides.md"
BYTES_S = 1024  # the recorder assumes this rate until it has measured a block
# Size of the file system in MicroPython's images, in KB. The sources are ports/rp2/boards/*/mpconfigboard.cmake and
# ports/esp32/partitions-4MiBplus.csv.
FLASH_KB = {"Pico": 1408, "Pico W": 848, "Pico 2": 3072, "Pico 2 W": 2560, "ESP32 with 4 MB of flash": 2048}


def rows():
    section = PAGE.read_text(encoding="utf-8").partition("| recorded to |")[2].partition("\n\n")[0]
    return {name.strip(): int(value) for name, value in re.findall(r"^\| ([^|]+) \| (\d+) ", section, re.MULTILINE)}


def room_s(monkeypatch, tmp_path, spi, size, used):
    """Return the recording time in s that a board reports if its flash or card has no rides.

    spi: None for the flash, a number for a card. size, used: bytes of the file system, and bytes in use.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("os.ilistdir", lambda _path: iter(()), raising=False)
    monkeypatch.setattr(ride_paths, "directory", lambda _settings: "rides")
    monkeypatch.setattr(flash_ring, "free_bytes", lambda _path: size - used)
    monkeypatch.setattr(flash_ring, "all_bytes", lambda _path: size)
    ring = RideRing(types.SimpleNamespace(SD_SPI=spi))
    ring.begin()
    return ring.room() / BYTES_S


@pytest.mark.parametrize("board", FLASH_KB)
def test_the_minutes_of_a_board(board, monkeypatch, tmp_path):
    seconds = room_s(monkeypatch, tmp_path, None, FLASH_KB[board] * 1024, flash_ring.FIRMWARE)
    assert rows()[board] == int(seconds / 60)


def test_the_hours_of_a_card(monkeypatch, tmp_path):
    assert rows()["SD card, for each GB"] == int(room_s(monkeypatch, tmp_path, 0, 10**9, 0) / 3600)


def test_a_rough_ride_takes_no_more_than_that():
    written, held = ride_writer.blocks(20)
    bytes_s = sum(map(len, written)) / (sum(dt_us for *_, dt_us in held) / 1e6)
    assert 0.5 * BYTES_S < bytes_s <= BYTES_S
