"""How blocks of a ride become a log. The expected rows were computed by hand."""

import io
import threading
from dataclasses import replace

import numpy as np
import pytest
from kickstand.calibration import store
from kickstand.calibration.parameters import Calibration
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.common.messages import InputError
from kickstand_tools.replay.replay import replay
from kickstand_tools.rides import ride_log
from kickstand_tools.rides.ride_log import Place, StoredBlock, StoredTurn
from kickstand_tools.rides.stream import CHANGED, StreamLog
from support.recordings import ride_writer

TRACK = ("speed_mps", "lat_deg", "lon_deg", "utc_s")


def turn(time_us, n=2, sums=(0, 32768, -16384, 262, 0, -131), **more) -> StoredTurn:
    return StoredTurn(time_us, n, tuple(sums), more.get("speed"), more.get("place"))


def block(turns=None, sequence=0, time_us=1_000_000, sample_hz=200, bias=0.0, vehicle="") -> StoredBlock:
    """Return a block of two passes of the loop. It has 16384 counts per g, 131 per deg/s, 21.05 C and no alignment."""
    calibration = Calibration()
    calibration.gyro_bias[0] = bias
    body = store.pack(0x68, 16, calibration)
    upright = (0, 32768, 0, 0, 0, 0)
    turns = turns or [turn(time_us + 10_000 * k, sums=upright, speed=3.0) for k in (1, 2)]
    return StoredBlock(1, sequence, time_us, 2105, 16384, 1310, sample_hz, "1.0.0", 49, body, 7, turns, vehicle)


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


def test_replay_subtracts_the_delay_of_the_ride(tmp_path):
    cal = read_calibration(ride_log.write(tmp_path / "ride.csv", [ride_log.parse(ride_writer.blocks(1)[0][0])]))
    assert cal.gyro_delay_s == 0.0134  # the delay with DLPF 5
    late, early = (replay(tmp_path / "ride.csv", replace(cal, gyro_delay_s=delay_s)) for delay_s in (None, 0.0134))
    ahead = early.lean_deg - late.lean_deg
    assert np.abs(ahead - (0.0134 - 0.0048) * early.roll_rate_dps)[200:].max() < 0.02
    assert np.abs(ahead).max() > 0.02
    replayed = replay(tmp_path / "ride.csv", cal, engine="micropython")
    assert np.abs(replayed.lean_deg - early.lean_deg).max() < 0.01


# The log of a stream, which grows with each block


class File(io.StringIO):
    """A file on a disk with room for this number of writes."""

    def __init__(self, writes):
        super().__init__()
        self.writes = writes

    def write(self, text):
        self.writes -= 1
        if self.writes < 0:
            raise OSError(28, "No space left on device")
        return super().write(text)


def streamed(*blocks, live=None, writes=99):
    """Write blocks as a stream. Returns the StreamLog, the rows, the notes, and whether the stream was stopped."""
    stopped, notes, file = threading.Event(), [], File(writes)
    log = StreamLog(stopped, live)
    log.write(file, iter(blocks), notes)
    return log, file.getvalue().splitlines(), notes, stopped.is_set()


def test_lost_blocks_and_gaps_of_a_stream_are_noted():
    notes = streamed(block(sequence=2), block(sequence=5, time_us=2_000_000))[2]
    assert notes == ["4 blocks of half a second did not arrive: the log has gaps"]  # the lost blocks are 0, 1, 3 and 4
    assert streamed(block([turn(1_010_000), turn(2_000_000)]))[2] == [ride_log.missing_note([0.98])]
    with pytest.raises(InputError, match="nothing was recorded: does the display show readings"):
        streamed()


def test_stream_ends_with_a_full_disk_or_a_new_calibration():
    log, rows, notes, stopped = streamed(block(), block(sequence=1), block(sequence=2), writes=1)
    assert (log.count, len(rows), stopped, len(notes)) == (2, 3, True, 1)
    assert notes[0].startswith("writing the log failed (")
    log, _, notes, stopped = streamed(block(), block(sequence=1, bias=1.0), block(sequence=2))
    assert (log.count, notes, stopped) == (2, [CHANGED], True)
