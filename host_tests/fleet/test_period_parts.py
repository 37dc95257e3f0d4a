"""Parts of the result of a period: rows, messages, and the points of the picture."""

import errno
import importlib
import sys

import kickstand_fleet
import numpy as np
import pytest
from kickstand_fleet import files, period, tables
from kickstand_fleet.journal import StoreJournal
from kickstand_fleet.manifest import Period
from kickstand_fleet.moved import Move
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.log import Log
from made_fleet import drive, worked_on

THEIRS = Period("bus 12", "front", "car", ("a.csv",))


def named_log(name, start_utc_s=None):
    t_s = np.arange(5.0)
    utc_s = np.full(5, np.nan) if start_utc_s is None else start_utc_s + t_s
    return Log(t_s, np.ones((5, 3)), np.zeros((5, 3)), np.full(5, 3.0), utc_s=utc_s, name=name)


def move(log, at_s, angle_deg):
    return Move(log, at_s, np.array([0.0, angle_deg, 0.0]), np.ones(3))


@pytest.mark.parametrize(
    ("moves", "said", "unsaid"),
    [
        ([move(1, None, 7.4)], ["by 7 degrees before b.csv: give b.csv and the logs after it"], ["times more", " s"]),
        ([move(0, 63.4, 7.6)], ["by 8 degrees in a.csv at 63 s: cut it there", "second part"], ["times more"]),
        ([move(0, 3.0, 7.0), move(1, None, 30.0)], ["by 7 degrees in a.csv at 3 s, and 1 times more"], ["30"]),
        ([move(1, None, 7.0)] * 3, ["before b.csv, and 2 times more: give"], []),
    ],
)
def test_the_message_names_the_first_move(moves, said, unsaid):
    words = period._moved_words(moves, [named_log("a.csv"), named_log("b.csv")])
    assert all(part in words for part in said) and not any(part in words.partition(":")[0] for part in unsaid)


def test_a_row_of_a_move_has_its_time_and_its_rotation():
    found = Move(1, 2.5, np.array([3.0, 12.0, 4.0]), np.array([1.0, 2.0, 1.0]))
    row = period._moved_row(found, [named_log("a.csv"), named_log("b.csv", 1.79e9)])
    assert (row["log"], row["within_log"], row["at_s"], row["utc_s"]) == ("b.csv", True, 2.5, 1.79e9 + 2.5)
    assert row["turned_deg"] == pytest.approx(13.0) and row["turned_sigma_deg"] == found.angle_sigma_deg
    assert (row["about_left_deg"], row["about_up_deg"], row["about_forward_deg"]) == (3.0, 12.0, 4.0)
    assert row["sigmas"] == pytest.approx(np.sqrt(61.0))
    between = period._moved_row(move(1, None, 9.0), [named_log("a.csv"), named_log("b.csv", 1.79e9)])
    assert (between["within_log"], between["at_s"], between["utc_s"]) == (False, None, 1.79e9)
    assert period._moved_row(move(0, None, 9.0), [named_log("a.csv")])["utc_s"] is None


def test_a_failed_period_has_one_row_of_errors_and_no_numbers():
    found = period.failed(THEIRS, "crashed", "its worker died")
    row = found.alignment
    assert (row["vehicle"], row["mount"], row["kind"], row["status"]) == ("bus 12", "front", "car", "error")
    assert (row["reason"], row["message"], row["logs"], row["logs_left_out"]) == ("crashed", "its worker died", 0, 1)
    assert (row["driven_s"], row["stops"], row["events_used"], row["events_in_turns"]) == (0.0, 0, 0, 0)
    assert row["start_utc_s"] is row["vehicle_from_sensor"] is row["gyro_bias_dps"] is row["quality_deg"] is None
    assert found.errors == [
        {"vehicle": "bus 12", "mount": "front", "log": "", "reason": "crashed", "message": "its worker died"}
    ]
    assert found.moved == found.brake_tests == found.picture == []


def raising(error):
    def broken(*_):
        raise error

    return broken


@pytest.mark.parametrize(
    ("error", "reason", "said"),
    [
        (MemoryError(), "no-memory", "more memory than there is"),
        (OSError(errno.EIO, "Input/output error"), "unreadable", "Input/output error"),
        (KeyError("x"), "fault", "KeyError: 'x' (test_period_parts.py, line "),
    ],
)
def test_no_error_stops_a_fleet(monkeypatch, error, reason, said):
    monkeypatch.setattr(period, "_result", raising(error))
    found = period.work_on_period(THEIRS)
    assert (found.alignment["status"], found.alignment["reason"]) == ("error", reason)
    assert said in found.errors[0]["message"]


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.ENOSPC, "No space left"), "disk-full"),
        (OSError(errno.EDQUOT, "Quota exceeded"), "disk-full"),
        (OSError(errno.EIO, "Input/output error"), "not-finished"),
        (InputError("no"), "not-finished"),
    ],
)
def test_brake_tests_or_signals_that_fail_cost_only_themselves(monkeypatch, error, reason):
    """The log has a row of errors. The other results stay."""
    monkeypatch.setattr(period, "brake_tests", raising(error))
    found = period.PeriodResult({"status": "aligned"})
    period._add_drive(found, THEIRS, named_log("a.csv"), CalibrationFile(aligned=True), None)
    assert found.alignment["status"] == "aligned" and found.brake_tests == []
    assert [(row["log"], row["reason"]) for row in found.errors] == [("a.csv", reason)]


def test_an_aligned_drive_has_its_numbers_and_its_picture(tmp_path):
    log, sensor = drive(21)
    found = worked_on(tmp_path, log)
    row = found.alignment
    assert (row["logs"], row["logs_left_out"], row["mount"]) == (1, 0, "")
    assert row["driven_s"] == pytest.approx(log.t_s[-1], abs=0.01)
    assert row["start_utc_s"] == pytest.approx(1.79e9, abs=0.2) and row["speed_lag_s"] == pytest.approx(0.3, abs=0.1)
    assert np.reshape(row["vehicle_from_sensor"], (3, 3)) == pytest.approx(sensor.mount, abs=0.03)
    assert row["gyro_bias_dps"] == pytest.approx(sensor.bias_dps, abs=0.1)
    assert row["stops"] >= 3 and row["events_used"] > 5 and 0.0 < row["quality_deg"] < row["attitude_deg"] < 3.0
    points = np.array(found.picture)
    assert 80 < len(points) <= 160 and points.shape[1] == 4
    assert np.array_equal(points, points.round(3)) and not np.array_equal(points, points.round(2))
    dv, forward, centripetal, left = points.T
    assert np.corrcoef(dv, forward)[0, 1] > 0.9 and np.polyfit(dv, forward, 1)[0] == pytest.approx(1.0, abs=0.15)
    assert np.corrcoef(centripetal, left)[0, 1] > 0.9
    stop = found.brake_tests[0]
    assert stop["utc_s"] == pytest.approx(row["start_utc_s"] + stop["start_s"]) and stop["log"].endswith("1.csv")
    assert stop["initial_speed_mps"] > 5.0 and 1.0 < stop["mfdd_mps2"] < 4.0 and stop["distance_m"] > 5.0


def test_logs_without_speed_are_refused_and_unreadable_ones_are_errors(tmp_path):
    log, _ = drive(21, seconds=60.0)
    log.speed_mps[:] = np.nan
    found = worked_on(tmp_path, log)
    assert (found.alignment["status"], found.alignment["reason"]) == ("refused", "no-speed")
    assert (found.alignment["logs"], found.alignment["logs_left_out"]) == (0, 1)
    (tmp_path / "bad.csv").write_text("nothing")
    both = period.work_on_period(Period("v", "", "car", (str(tmp_path / "bad.csv"), str(tmp_path / "1.csv"))))
    assert (both.alignment["status"], both.alignment["reason"]) == ("refused", "no-speed")
    assert [row["reason"] for row in both.errors] == ["unreadable", "no-speed"]


def test_names_that_are_not_utf8_are_printable():
    found = period.work_on_period(Period("v\udcff", "", "car", ("none.csv",)))
    assert found.alignment["vehicle"] == "v\\udcff"


def test_a_missing_library_is_named(monkeypatch):
    """The module of the tables is imported without the library, too."""
    monkeypatch.setattr(kickstand_fleet, "tables", tables)  # restored at the end, as sys.modules is
    monkeypatch.delitem(sys.modules, "kickstand_fleet.tables")
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    without = importlib.import_module("kickstand_fleet.tables")
    with pytest.raises(InputError, match=r"a fleet needs pyarrow: .*fleet\]"):
        without.check()


def test_a_long_name_is_cut_and_unique():
    """A file system allows 255 bytes. A character that is encoded is never cut in the middle."""
    one, other = files.folder_value("x" * 101), files.folder_value("x" * 102)
    assert files.folder_value("x" * 100) == "x" * 100
    assert one[:101] == other[:101] == "x" * 100 + "-" and one != other and len(one) == 100 + 1 + 10
    assert files.folder_value("x" * 98 + "ä").startswith("x" * 98 + "-")
    assert files.file_stem("..a", "x", "y") != files.file_stem("..a", "xy") != files.file_stem("..a", "x", "y", "")
    assert files.file_stem("..a", "x").startswith("a-")


def test_marks_in_a_store_are_read_once_per_folder(monkeypatch):
    base = "memory://fleet-marks"
    for name in ("a/1", "a/2", "b/1"):
        files.write_bytes(f"{base}/{name}", name.encode())
    asked = []
    listed = files.listed
    monkeypatch.setattr(files, "listed", lambda parent: asked.append(parent) or listed(parent))
    place = "memory:///fleet-marks"
    marks = files.identities([f"{place}/a/1", f"{place}/a/2", f"{place}/b/1", f"{place}/a/3"])
    assert asked == [f"{place}/a", f"{place}/b"]
    assert marks[f"{place}/a/3"] == "" and all(mark.startswith("3-") for mark in list(marks.values())[:3])


def test_a_damaged_result_in_a_store_is_counted_and_computed_again():
    place = "memory://fleet-journal/journal"
    with StoreJournal(place) as journal:
        for key in ("a", "b", "c"):
            journal.add(key, period.failed(THEIRS, "crashed", key), again=key == "c")
    for name in ("b.json", "c.again.json"):
        files.write_bytes(f"{place}/{name}", b'{"key": "b"')
    with StoreJournal(place) as journal:
        assert journal.damaged == 2
        assert ["a" in journal, "b" in journal, "c" in journal] == [True, False, False]
        assert [found.alignment["message"] for found in journal.results(["a", "b", "c"])] == ["a"]
