"""The whole device with realistic SD cards, on the simulated board with MicroPython's own FAT. Some cards are busy for
long, reject data, start slowly, count their room slowly, or stop answering."""

import base64

import pytest
from kickstand_tools.common import installation
from kickstand_tools.rides import ride_log
from support import device_plans

pytestmark = pytest.mark.skipif(not installation.has_micropython(), reason="no MicroPython unix port for this system")

PINS = {"SD_SPI": 0, "SD_SCK": 18, "SD_MOSI": 19, "SD_MISO": 16, "SD_CS": 17, "RECORD": True}
RIDE = {"lean": [[0, 0], [5, 20]], "until": 22, "config": PINS}
long = pytest.mark.long


def run(flash, card=None, **plan):
    """Run a ride with this card. The plan says whether the board is aligned."""
    return device_plans.run("micropython", flash, {**RIDE, "card": card or {}, **plan})


def blocks(record):
    """Return the blocks of the rides on the card."""
    stored = []
    for _, content in sorted((record.rides or {}).items()):
        part, problems = ride_log.read(base64.b64decode(content))
        assert set(problems) <= {ride_log.CUT_SHORT}
        stored += part
    return stored


def missing_s(record):
    return [seconds for block in blocks(record) for seconds in block.missing_s()]


def leans_on(record, since_s):
    """Return True if the display shows the right lean about 10 s after since_s, and the board has not restarted."""
    later = [record.at(since_s + 9.5 + 0.25 * k)[0] for k in range(8)]  # a message may hide the lean for a while
    return record.ends == ["off"] and any(line.startswith("Raw   20°") for line in later)


def test_card_records_without_loss_in_little_time(tmp_path):
    """With the driver's default clock, writing a block would take 25 ms. Reading the FAT of a 32 GB card would take
    25 s. The card is busy for 250 ms at each block, once in eight seconds, as its specification allows. The sensor's
    FIFO keeps readings for longer."""
    record = run(tmp_path, {"faults": [[5.0 + 8.0 * i, "busy_next_s", 0.25] for i in range(2)]})
    assert record.card_hz >= 8_000_000
    assert len(blocks(record)) >= 2 and missing_s(record) == []
    assert record.first("Raw") < 1.5 and leans_on(record, 9)


@pytest.mark.parametrize("fault", [["rejects", 1], pytest.param(["stuck", True], marks=long)])
def test_failing_card_ends_the_ride_without_a_restart(fault, tmp_path):
    record = run(tmp_path, {"faults": [[10.0, *fault]]}, until=32)
    assert 10 < record.first("card fault") < 19
    assert blocks(record) and leans_on(record, 20)


@pytest.mark.parametrize(
    "card",
    [
        pytest.param({"init_s": None}, marks=long),  # the driver waits 5 s for the card
        pytest.param({"init_s": 4.5, "formatted": False}, marks=long),
        {"driver": False},
        pytest.param({"faults": [[0.0, "rejects", 1000]]}, marks=long),
    ],
    ids=["never ready", "no file system", "no driver", "rejects all"],
)
def test_unusable_card_is_reported_without_a_restart(card, tmp_path):
    record = run(tmp_path, card, until=24)
    assert record.first("No SD card|SD card:") < 12 and leans_on(record, 12)
    assert record.console.count("SD card: ") in (1, 2) and not blocks(record)
    assert ("its driver is not on the board: mpremote mip install sdcard" in record.console) is ("driver" in card)
