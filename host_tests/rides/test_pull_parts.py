"""Tests how rides from a board become logs: rows, gaps, names and attempts. Expected results were computed by hand."""

import binascii
import gzip
import io
import struct
import threading
from binascii import b2a_base64
from types import SimpleNamespace

import pytest
from kickstand.calibration import store
from kickstand.calibration.parameters import Calibration
from kickstand.rides import block as block_format
from kickstand_tools.common.errors import InputError
from kickstand_tools.rides import block_reader, pull, record, ride_log, stream
from kickstand_tools.rides.block_reader import Place, StoredBlock, StoredTurn
from kickstand_tools.rides.stream import StreamLog


def block(turns, sequence=0, time_us=1_000_000, sample_hz=200) -> StoredBlock:
    """Return a block with 16384 counts per g and 131 counts per deg/s, at 21.05 C."""
    return StoredBlock(1, sequence, time_us, 2105, 16384, 1310, sample_hz, "1.0.0", 49, b"\x68", 7, turns)


def turn(time_us: int, n: int = 2, sums=(0, 32768, -16384, 262, 0, -131), speed=None, place=None) -> StoredTurn:
    return StoredTurn(time_us, n, tuple(sums), speed, place)


def test_a_row_is_the_mean_of_the_samples_of_a_turn():
    rows = list(ride_log.rows([block([turn(1_010_000), turn(1_020_000, n=1)])], (), 1_000_000))
    first = ["0.010000", "0.0000000", "1.0000000", "-0.5000000", "1.000000", "0.000000", "-0.500000", "21.05"]
    assert rows[0] == first
    assert rows[1][2] == "2.0000000" and rows[1][-1] == "" and rows[1][0] == "0.020000"


def test_a_row_has_the_speed_and_the_place_of_its_turn():
    track = ("speed_mps", "lat_deg", "lon_deg", "utc_s")
    places = [Place(48.5, -11.25, 1.7e9), Place(48.5, -11.25, None), None]
    turns = [turn(1_010_000, speed=speed, place=place) for speed, place in zip((12.345, None, None), places)]
    cells = [row[7:11] for row in ride_log.rows([block(turns)], track)]
    assert cells == [
        ["12.35", "48.5000000", "-11.2500000", "1700000000.000"], ["", "48.5000000", "-11.2500000", ""], [""] * 4,
    ]  # fmt: skip
    assert ride_log.header(track)[7:] == (*track, "temp_c")


def test_a_turn_that_is_late_by_over_two_samples_is_a_gap():
    """The samples are 5 ms apart. If two samples arrive after 20 ms, they are late by 10 ms, which is exactly two
    samples. If the two samples arrive after 20.001 ms, they are late by a microsecond more."""
    assert block([turn(1_020_000)]).missing_s() == []
    assert block([turn(1_020_001)]).missing_s() == [0.010001]
    assert block([turn(1_010_000), turn(1_520_000)]).missing_s() == [0.5]
    assert block([turn(1_020_000)], sample_hz=1000).missing_s() == [0.018]


def test_gaps_are_counted_in_words():
    assert block_reader.missing_note([1.25]).startswith("readings are missing once, 1.2 s in all")
    assert block_reader.missing_note([1.0, 2.0]).startswith("readings are missing 2 times, 3.0 s in all")


def test_positions_are_in_hundred_thousandths_of_a_minute():
    """The date has 7 bits for the years since 2000, 4 bits for the month and 5 bits for the day."""
    degree = 60 * 100_000

    def places(*rows):
        return list(block_reader._places(b"".join(struct.pack(block_format.PLACE, *row) for row in rows)))

    date = 26 << 9 | 5 << 5 | 17
    ((entry, place),) = places((3, date, 1500, degree * 48, -degree * 11 // 2))
    assert entry == 3 and (place.lat_deg, place.lon_deg, place.utc_s) == (48.0, -5.5, 1_778_976_001.5)
    ((_, no_date),) = places((3, 0, 1500, 0, 0))
    assert no_date.utc_s is None
    assert len(places((1, date, 0, 90 * degree, 180 * degree), (2, date, 0, -90 * degree, -180 * degree))) == 2
    assert places((1, date, 0, 90 * degree + 1, 0), (2, date, 0, 0, -180 * degree - 1)) == []


def test_bytes_that_are_no_block_are_named():
    for data, reason in ((b"xy", "not of a ride"), (block_format.MAGIC, "cut short")):
        with pytest.raises(block_reader.BadBlock, match=reason):
            block_reader.parse(data)
    assert block_reader.read(b"x" * 40 + block_format.MAGIC) == ([], ["not of a ride at byte 0", "cut short"])
    assert block_reader.read(b"") == ([], [])


def test_an_earlier_log_is_counted_and_keeps_its_name(tmp_path):
    log = tmp_path / "ride-00001-abcd.csv.gz"
    assert pull._readings(log) == 0
    log.write_bytes(gzip.compress(b"names\n1\n2\n"))
    assert pull._readings(log) == 2
    log.write_bytes(b"no gzip")
    assert pull._readings(log) == 0
    assert pull._free_name(log).name == "ride-00001-abcd-2.csv.gz"
    (tmp_path / "ride-00001-abcd-2.csv.gz").touch()
    assert pull._free_name(log).name == "ride-00001-abcd-3.csv.gz"


def sent(monkeypatch, *attempts):
    """Let the board send these lines in successive attempts. Returns what _read() gives and what it has reported."""
    lists, came = iter(attempts), []
    monkeypatch.setattr(pull, "lines", lambda *_, **more: iter(next(lists)))
    part = pull._Part(1, 1, 6, "/rides/1")
    return pull._read(None, part, "ride 1", lambda what, count: came.append((what, count))), came  # type: ignore[arg-type]


def lines_of(*pieces: bytes, crc: int | None = None) -> list[bytes]:
    whole = b"".join(pieces)
    end = f"({len(whole)}, {binascii.crc32(whole) if crc is None else crc})".encode()
    return [*(b2a_base64(piece).strip() for piece in pieces), end]


def test_a_file_is_copied_again_if_its_check_sum_is_wrong(monkeypatch):
    found, came = sent(monkeypatch, lines_of(b"abc", b"def"))
    assert found == (b"abcdef", True) and came == [("pulling ride 1", 0), ("pulling ride 1", 3), ("pulling ride 1", 3)]
    found, came = sent(monkeypatch, lines_of(b"abc", b"deX", crc=1), lines_of(b"abcdef"))
    assert found == (b"abcdef", True) and len(came) == 3  # the second attempt is not reported
    assert sent(monkeypatch, lines_of(b"abcd", crc=1), lines_of(b"ab", crc=1))[0] == (b"abcd", False)
    # The content is shorter than announced
    assert sent(monkeypatch, lines_of(b"abcde"), lines_of(b"abcde"))[0] == (b"abcde", False)
    # The content is longer, because a ride may grow
    assert sent(monkeypatch, lines_of(b"abcdefg"))[0] == (b"abcdefg", True)
    assert sent(monkeypatch, [b"YWJj", b"YWJ"], [b"YWJj"])[0] == (b"abc", False)


def test_only_rides_in_their_directory_are_accepted(monkeypatch):
    def listed(*rows):
        text = "\n".join(["('/rides', 'car')", *map(repr, rows)])
        monkeypatch.setattr(pull, "printed", lambda *_: text.encode())
        return pull._list(None, "port")  # type: ignore[arg-type]

    rows = (2, 1, 5, "/rides/b"), (1, 2, 4, "/rides/a2"), (1, 1, 3, "/rides/a1")
    directory, vehicle, rides = listed(*rows)
    assert (directory, vehicle, list(rides)) == ("/rides", "car", [1, 2])
    assert [part.path for part in rides[1]] == ["/rides/a1", "/rides/a2"]
    assert listed()[2] == {} and list(listed((99_999, 1, 1, "/rides/x"))[2]) == [99_999]
    for row in ((100_000, 1, 1, "/rides/x"), (1, 1, 1, "/other/x")):
        with pytest.raises(InputError, match="lists invalid rides"):
            listed(row)


class Full:
    """A file on a full disk: the first write stores three bytes, the second fails."""

    def __init__(self, real):
        self.real, self.writes = real, 0

    def write(self, data):
        self.writes += 1
        if self.writes > 1:
            raise OSError(28, "No space left on device")
        return self.real.write(data[:3])

    def __getattr__(self, name):
        return getattr(self.real, name)


@pytest.mark.parametrize("packed", [False, True])
def test_a_growing_file_has_only_whole_writes(tmp_path, monkeypatch, packed):
    path = tmp_path / "log"
    with record._GrowingFile(path, packed) as file:
        assert file.write("one\n") == 4
        whole, real = path.read_bytes(), file._file
        monkeypatch.setattr(file, "_file", Full(real))
        with pytest.raises(OSError, match="No space"):
            file.write("two\n")
        assert path.read_bytes() == whole
        monkeypatch.setattr(file, "_file", real)
        file.write("three\n")
    content = path.read_bytes()
    assert (gzip.decompress(content) if packed else content) == b"one\nthree\n"


def test_a_recording_needs_a_new_name_with_a_logs_suffix(tmp_path):
    with pytest.raises(InputError, match=r"ends in \.csv or \.csv\.gz"):
        record.record(None, tmp_path / "a.txt")
    for name in ("a.csv", "a.cal.json"):
        (tmp_path / name).touch()
        with pytest.raises(InputError, match="exists already"):
            record.record(None, tmp_path / "a.csv")
        (tmp_path / name).unlink()


def streamed(given, live=None, fails=0):
    """Write blocks as a stream. Returns the StreamLog, the text, the notes, and whether the stream was stopped."""
    stopped, notes = threading.Event(), []
    log, file = StreamLog(stopped, live), io.StringIO()
    real = file.write

    def write(text):
        nonlocal fails
        fails -= 1
        if fails == 0:
            raise OSError(28, "No space left on device")
        return real(text)

    file.write = write  # type: ignore[method-assign]
    log.write(file, iter(given), notes)
    return log, file.getvalue(), notes, stopped.is_set()


def whole_block(sequence=0, time_us=1_000_000, turns=2, car=False, changed=0) -> StoredBlock:
    """A block with the calibration of a sensor that is not aligned, and passes of the loop with two samples in each 10
    ms."""
    calibration = Calibration()
    calibration.set_scale(16384, 131.0)
    calibration.gyro_bias[0] = float(changed)
    body = store.pack(0x68, 16, calibration)
    made = [turn(time_us + 10_000 * (k + 1), sums=(0, 32768, 0, 0, 0, 0), speed=3.0) for k in range(turns)]
    return StoredBlock(
        1, sequence, time_us, 2105, 16384, 1310, 200, "1.0.0", 49, body, 7, made, "car" if car else "motorcycle"
    )


def test_a_stream_is_a_log_from_its_first_block():
    log, text, notes, stopped = streamed([whole_block(), whole_block(1, 1_020_000, 3)])
    head, *rows = text.splitlines()
    assert head.startswith("t_s,ax_g") and head.endswith("utc_s,temp_c") and len(rows) == 5
    assert [row.partition(",")[0] for row in rows] == ["0.010000", "0.020000", "0.030000", "0.040000", "0.050000"]
    assert (log.count, log.seconds, log.written, notes, stopped) == (5, 0.05, True, [], False)


def test_lost_blocks_and_gaps_of_a_stream_are_noted():
    notes = streamed([whole_block(2), whole_block(5, 2_000_000)])[2]
    assert notes == ["4 blocks of half a second did not arrive: the log has gaps"]  # the lost blocks are 0, 1, 3 and 4
    late = whole_block()
    late.turns[1] = turn(2_000_000, sums=(0, 32768, 0, 0, 0, 0))
    assert streamed([late])[2] == [block_reader.missing_note([0.98])]
    with pytest.raises(InputError, match="nothing was recorded: does the display show readings"):
        streamed([])


def test_a_stream_ends_with_a_full_disk_or_a_new_calibration():
    log, text, notes, stopped = streamed([whole_block(), whole_block(1, 1_020_000), whole_block(2)], fails=2)
    assert log.count == 2 and len(text.splitlines()) == 3 and stopped
    assert len(notes) == 1 and notes[0].startswith("writing the log failed (")
    log, _, notes, stopped = streamed([whole_block(), whole_block(1, changed=1), whole_block(2)])
    assert log.count == 2 and notes == ["the board's calibration has changed: the log ends here"] and stopped


@pytest.mark.parametrize("car", [False, True])
def test_the_live_readings_of_a_block(car):
    """The sensor is not aligned, so neither lean nor force is shown. The block has 2 entries in 20 ms."""
    seen: list = []
    streamed([whole_block(car=car), whole_block(1, 1_020_000, 0)], seen.append)
    first, second = seen
    assert (first.aligned, first.rate_hz, first.seconds, second.seconds) == (False, 100.0, 0.02, 0.02)
    assert first.moments == [(0.01, None, None, None), (0.02, None, None, None)]
    assert (first.max_left_deg, first.max_brake_g) == (0.0, 0.0) and (second.moments, second.rate_hz) == ([], 0.0)


def test_blocks_of_a_stream_end_with_a_point(monkeypatch):
    given = [b"vehicle car", b"YWJj", b"ZGVm", b".", b"!", b".", b"YWJj", b"."]
    monkeypatch.setattr(stream, "lines", lambda *_: iter(given))
    parsed: list = []
    monkeypatch.setattr(stream, "parse", lambda data: parsed.append(data) or SimpleNamespace(data=data))
    notes: list = []
    found = list(stream.blocks(None, "P", notes, threading.Event()))  # type: ignore[arg-type]
    assert parsed[0] == b"abcdef" and parsed[-1] == b"abc"
    assert {one.vehicle for one in found} == {"car"}
    assert notes == ["P: the board stopped on its own: the log up to there is kept"]


def pulled(monkeypatch, tmp_path, *contents, whole=True, problems=()):
    """Pull a ride of parts with these blocks. problems: the problems of the last part."""
    parts = [pull._Part(3, k, 6, f"/rides/{k}") for k in range(len(contents))]
    monkeypatch.setattr(pull, "_read", lambda _, part, *more: (b"abc", whole))
    given = iter(contents)
    monkeypatch.setattr(pull, "read", lambda _: (made := next(given), list(problems) if made is contents[-1] else []))
    monkeypatch.setattr(pull.ride_log, "write", lambda path, blocks: path.touch())
    return pull._pull_ride(None, 3, parts, "car", tmp_path, lambda *_: None)  # type: ignore[arg-type]


def test_a_pulled_ride_has_its_name_and_its_length(monkeypatch, tmp_path):
    found = pulled(monkeypatch, tmp_path, [whole_block(), whole_block(1, 1_020_000)], [whole_block(2, 1_040_000)])
    assert found.log == tmp_path / "ride-00003-0007.csv.gz" and (found.seconds, found.readings) == (0.06, 6)
    assert found.whole and not found.problems


def test_problems_of_a_pulled_ride_are_named(monkeypatch, tmp_path):
    def lines(*contents, **more):
        found = pulled(monkeypatch, tmp_path, *contents, **more)
        return found.problems, found.whole

    assert lines([whole_block()], problems=["cut short"]) == (
        ["ride 3, part 0: the last block is cut short, as by a power cut: left out"], True,
    )  # fmt: skip
    assert lines([whole_block()], problems=["damaged at byte 9"]) == (
        ["ride 3, part 0: damaged at byte 9: left out"], False,
    )  # fmt: skip
    assert lines([whole_block()], whole=False)[0][0].startswith("ride 3, part 0: only 3 of its 6 bytes arrived: try")
    assert lines([]) == (["ride 3: nothing in it can be read"], False)
    gap = lines([whole_block(), whole_block(4, 1_020_000)])
    assert gap == (["ride 3: 3 blocks are missing: the log has a gap there"], True)
    begun = lines([whole_block(5)])
    assert begun == (["ride 3: its beginning had to make room for later blocks"], True)


def test_a_longer_log_of_the_same_ride_stays(monkeypatch, tmp_path):
    for readings, kept in ((2, False), (3, True)):
        monkeypatch.setattr(pull, "_readings", lambda path, readings=readings: readings)
        (tmp_path / "ride-00003-0007.csv.gz").touch()
        found = pulled(monkeypatch, tmp_path, [whole_block()])
        assert (found.log == tmp_path / "ride-00003-0007-2.csv.gz") is kept and found.whole is not kept
