"""How blocks of a ride become a log. The expected rows were computed by hand."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand.calibration import store
from kickstand.calibration.parameters import Calibration
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.replay.replay import replay
from kickstand_tools.rides import block_reader, ride_log
from kickstand_tools.rides.block_reader import Place, StoredBlock, StoredTurn
from support.recordings import ride_writer

TRACK = ("speed_mps", "lat_deg", "lon_deg", "utc_s")


def turn(time_us, n=2, sums=(0, 32768, -16384, 262, 0, -131), **more) -> StoredTurn:
    return StoredTurn(time_us, n, tuple(sums), more.get("speed"), more.get("place"))


def block(turns, sample_hz=200) -> StoredBlock:
    """Return a block of these passes of the loop. It has 16384 counts per g, 131 per deg/s and 21.05 C."""
    body = store.pack(0x68, 16, Calibration())
    return StoredBlock(1, 0, 1_000_000, 2105, 16384, 1310, sample_hz, "1.0.0", 49, body, 7, turns)


def test_row_is_the_mean_of_the_samples_of_a_pass():
    first, second = ride_log.rows([block([turn(1_010_000), turn(1_020_000, n=1)])], (), 1_000_000)
    assert first == [
        "0.010000", "0.0000000", "1.0000000", "-0.5000000", "1.000000", "0.000000", "-0.500000", "21.05",
    ]  # fmt: skip
    assert second[2] == "2.0000000" and second[-1] == "" and second[0] == "0.020000"


def test_row_has_the_speed_and_the_place_of_its_pass():
    turns = [turn(1_010_000, speed=12.345, place=Place(48.5, -11.25, 1.7e9)),
             turn(1_010_000, place=Place(48.5, -11.25, None)), turn(1_010_000)]  # fmt: skip
    assert [row[7:11] for row in ride_log.rows([block(turns)], TRACK)] == [
        ["12.35", "48.5000000", "-11.2500000", "1700000000.000"], ["", "48.5000000", "-11.2500000", ""], [""] * 4,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("speed", "every", "columns"),
    [(False, 0, []), (False, 10, ["lat_deg", "lon_deg", "utc_s"]), (True, 10, list(TRACK))],
)
def test_log_has_no_empty_columns(speed, every, columns, tmp_path):
    blocks, _ = block_reader.read(b"".join(ride_writer.blocks(1, speed=speed, places_every=every)[0]))
    ride_log.write(tmp_path / "ride.csv", blocks)
    header, first = (tmp_path / "ride.csv").read_text().splitlines()[:2]
    assert header.split(",")[7:] == [*columns, "temp_c"]
    assert not columns or first.split(",")[-4:] == ["-33.8687242", "-179.9999998", "1798761582.100", "31.25"]


@pytest.mark.parametrize(
    ("turns", "sample_hz", "missing_s"),
    [
        # The samples are 5 ms apart. Two samples may be late by two sample periods.
        ([turn(1_020_000)], 200, []),
        ([turn(1_020_001)], 200, [0.010001]),
        ([turn(1_010_000), turn(1_520_000)], 200, [0.5]),
        ([turn(1_020_000)], 1000, [0.018]),
    ],
)
def test_pass_that_is_late_by_over_two_samples_is_a_gap(turns, sample_hz, missing_s):
    assert block(turns, sample_hz=sample_hz).missing_s() == missing_s


def test_gaps_are_counted_in_words():
    assert block_reader.missing_note([1.25]).startswith("readings are missing once, 1.2 s in all")
    assert block_reader.missing_note([1.0, 2.0]).startswith("readings are missing 2 times, 3.0 s in all")


def test_replay_subtracts_the_delay_of_the_ride(tmp_path):
    cal = read_calibration(ride_log.write(tmp_path / "ride.csv", [block_reader.parse(ride_writer.blocks(1)[0][0])]))
    assert cal.gyro_delay_s == 0.0134  # the delay with DLPF 5
    late, early = (replay(tmp_path / "ride.csv", replace(cal, gyro_delay_s=delay_s)) for delay_s in (None, 0.0134))
    ahead = early.lean_deg - late.lean_deg
    assert np.abs(ahead - (0.0134 - 0.0048) * early.roll_rate_dps)[200:].max() < 0.02
    assert np.abs(ahead).max() > 0.02
    again = replay(tmp_path / "ride.csv", cal, engine="micropython")
    assert np.abs(again.lean_deg - early.lean_deg).max() < 0.01
