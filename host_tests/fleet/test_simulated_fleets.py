"""The files of a simulated fleet: its vehicles, their faults, and what the tool must find."""

import csv
import gzip
import sys
from collections import Counter
from copy import copy

import numpy as np
import pytest
from fixed_chance import Fixed
from kickstand_fleet.simulation import fleet
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.log import Log

FAULTS = ["", "moved-between", "moved-within", "late", "dead", "dies", "km/h", "circles", "garbage", "empty", "cut"]


@pytest.fixture
def drives(monkeypatch):
    """Replace the simulated drives by logs of three samples. Return the arguments of each drive."""
    made = []

    def drive_log(_chance, kind, route, sensor, receiver, start_utc_s, moved):
        made.append((kind, route, sensor.mount.copy(), copy(receiver), start_utc_s, moved))
        t_s = np.array([0.0, 0.02, 0.04])
        ones = np.ones((3, 3))
        return Log(t_s, 0.1234567 * ones, 7.7654321 * ones, np.array([2.5, np.nan, 3.0]), name="x")

    monkeypatch.setattr(fleet, "drive_log", drive_log)
    return made


def table(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_vehicles_are_of_three_kinds_with_one_to_three_drives(drives, tmp_path):
    calls = []
    made = fleet.make_fleet(tmp_path, 30, 4, 30.0, troubles=[""] * 30, progress=lambda *counts: calls.append(counts))
    assert [vehicle.name for vehicle in made[:4]] == ["car-0000", "bus-0001", "motorcycle-0002", "car-0003"]
    assert [kind for kind, *_ in drives[: len(made[0].paths)]] == ["car"] * len(made[0].paths)
    counts = Counter(len(vehicle.paths) for vehicle in made)
    assert set(counts) == {1, 2, 3} and 8 <= counts[1] <= 22
    assert calls[0] == (1, 30) and calls[-1] == (30, 30)
    rows = table(tmp_path / "MANIFEST.csv")
    assert {row["kind"] for row in rows} == {"car", "motorcycle"}
    assert all(row["kind"] == ("motorcycle" if "motor" in row["vehicle"] else "car") for row in rows)
    assert [row["path"] for row in rows] == [str(p.relative_to(tmp_path)) for vehicle in made for p in vehicle.paths]
    plain = [vehicle.name for vehicle in made if vehicle.paths[0].suffix == ".csv"]
    assert plain == [vehicle.name for vehicle in made[::5]]
    assert made[0].paths[0].name == "car-0000-1.csv" and made[1].paths[0].name == "bus-0001-1.csv.gz"


def test_each_fault_has_its_share_of_the_fleet(drives, tmp_path):
    """The documentation names these faults. Each has 2 to 6 %."""
    fleet.make_fleet(tmp_path, 100, 1, 20.0)
    rows = table(tmp_path / "TRUTH.csv")
    assert Counter(row["trouble"] for row in rows) == {
        "": 67,
        "moved-between": 6,
        "moved-within": 6,
        "late": 3,
        "dead": 3,
        "dies": 2,
        "km/h": 3,
        "circles": 2,
        "garbage": 2,
        "empty": 2,
        "cut": 2,
        "missing": 2,
    }
    # The faults are in random order
    assert [row["trouble"] for row in rows] != sorted((row["trouble"] for row in rows), reverse=True)
    assert Counter(row["status"] for row in rows) == {"aligned": 100 - 6 - 6 - 3 - 3 - 3 - 2, "refused": 23}


def test_the_same_seed_gives_the_same_fleet(tmp_path):
    for name, seed in (("one", 1), ("same", 1), ("other", 2)):
        fleet.make_fleet(tmp_path / name, 2, seed, 20.0)
    one, same, other = ((tmp_path / name / "TRUTH.csv").read_text() for name in ("one", "same", "other"))
    assert one == same and one != other
    assert (tmp_path / "one/drives/car-0000-1.csv").read_bytes() == (
        tmp_path / "same/drives/car-0000-1.csv"
    ).read_bytes()


def test_faults_of_the_receiver(drives, tmp_path):
    made = fleet.make_fleet(tmp_path, 5, 1, 20.0, troubles=["", "late", "dead", "km/h", "dies"])
    receivers = {}
    for vehicle in made:
        receivers[vehicle.trouble] = [drives.pop(0)[3] for _ in vehicle.paths]
    assert receivers["late"][0].late_s == 2.6 and receivers["dead"][0].until_s == -1.0
    assert receivers["km/h"][0].factor == 3.6
    assert [one.until_s for one in receivers["dies"]][:2] == [float("inf"), 60.0] and len(receivers["dies"]) in (2, 3)
    for usual in receivers[""]:
        assert usual.every_s in (0.2, 0.5, 1.0) and 0.0 <= usual.late_s <= 1.2
        assert (usual.factor, usual.until_s) == (1.0, float("inf"))


def test_a_mount_moves_between_two_logs_or_during_one(drives, tmp_path):
    made = fleet.make_fleet(tmp_path, 20, 2, 20.0, troubles=["moved-between", "moved-within"] * 10)
    truth = table(tmp_path / "TRUTH.csv")
    for vehicle, row in zip(made, truth, strict=True):
        logs = [drives.pop(0) for _ in vehicle.paths]
        before, after = vehicle.mounts
        turn = after @ before.T
        assert np.degrees(np.arccos((np.trace(turn) - 1.0) / 2.0)) == pytest.approx(vehicle.moved_deg, abs=1e-6)
        assert 5.0 <= vehicle.moved_deg <= 40.0
        assert (float(row["moved_deg"]), int(row["moved_log"])) == (round(vehicle.moved_deg, 3), vehicle.moved_log)
        assert [float(row[name]) for name in fleet.MATRIX] == pytest.approx(after.ravel(), abs=1e-6)
        if vehicle.trouble == "moved-between":
            assert len(logs) in (2, 3) and vehicle.moved_log in range(1, len(logs)) and row["moved_s"] == ""
            for k, (_, _, mount, *_, moved) in enumerate(logs):
                assert moved is None and mount == pytest.approx(after if k >= (vehicle.moved_log or 0) else before)
        else:
            ((_, route, mount, *_, moved),) = logs
            assert moved[0] == vehicle.moved_s == float(row["moved_s"]) and moved[1] is after
            assert 0.39 * route.time[-1] < vehicle.moved_s < 0.61 * route.time[-1] and mount == pytest.approx(before)
    angles = [vehicle.moved_deg for vehicle in made]
    assert min(angles) < 10.0 and max(angles) > 20.0


def test_circles_never_go_straight(drives, tmp_path):
    fleet.make_fleet(tmp_path, 2, 2, 60.0, troubles=["circles", ""])
    circles, *others = (route for _, route, *_ in drives)
    turning = np.abs(circles.yaw_rate[circles.speed > 3.0]) > 0.05
    assert turning.mean() > 0.8
    assert all((np.abs(route.yaw_rate[route.speed > 3.0]) > 0.05).mean() < 0.7 for route in others)


def test_drives_take_about_the_wanted_time_on_later_days(drives, tmp_path):
    fleet.make_fleet(tmp_path, 8, 3, 100.0, 25.0, troubles=["moved-between"] * 8)
    lengths = [route.time[-1] for _, route, *_ in drives]
    assert 80.0 < min(lengths) and max(lengths) < 150.0 and {route.time[1] for _, route, *_ in drives} == {0.04}
    starts = [start for *_, start, _ in drives]
    assert all(1.79e9 <= start < 1.79e9 + 64 * 86_400.0 for start in starts)
    assert len({start // 86_400.0 for start in starts}) > 8


def test_usually_a_drive_has_50_samples_per_second_for_about_four_minutes(drives, tmp_path):
    fleet.make_fleet(tmp_path, 3, troubles=["moved-within"] * 3)
    assert {route.time[1] for _, route, *_ in drives} == {0.02}
    assert all(0.8 * 240.0 < route.time[-1] < 1.3 * 240.0 + 20.0 for _, route, *_ in drives)
    first = (tmp_path / "TRUTH.csv").read_text()
    fleet.make_fleet(tmp_path / "again", 3, 0, troubles=["moved-within"] * 3)
    assert (tmp_path / "again" / "TRUTH.csv").read_text() == first  # seed 0 is the default


def test_broken_files(drives, tmp_path):
    names = ["garbage", "empty", "cut", "missing", ""]
    made = fleet.make_fleet(tmp_path, 5, 3, 20.0, troubles=names)
    garbage, empty, cut, missing, whole = (vehicle.paths for vehicle in made)
    assert garbage[0].read_bytes() == bytes(range(128, 256)) * 20 and empty[0].read_bytes() == b""
    with pytest.raises(EOFError):
        gzip.decompress(cut[0].read_bytes())
    assert not missing[0].exists()
    text = gzip.decompress(whole[0].read_bytes())
    assert len(cut[0].read_bytes()) == len(whole[0].read_bytes()) * 9 // 10
    for later in (*garbage[1:], *empty[1:], *missing[1:]):
        assert later.read_bytes() in (text, gzip.compress(text, 1, mtime=0))
    assert text.decode().replace('"', "").splitlines() == [
        "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,speed_mps,utc_s",
        "0,0.12346,0.12346,0.12346,7.7654,7.7654,7.7654,2.5,",
        "0.02,0.12346,0.12346,0.12346,7.7654,7.7654,7.7654,,",
        "0.04,0.12346,0.12346,0.12346,7.7654,7.7654,7.7654,3,",
    ]
    # The file contains no date, so that the same seed gives the same bytes
    assert whole[0].read_bytes()[4:8] == bytes(4)


@pytest.mark.parametrize("trouble", FAULTS)
def test_the_truth_says_if_the_vehicle_can_be_aligned(trouble):
    vehicle = fleet.MadeVehicle("a", "car", trouble, [], [np.eye(3)])
    refused = trouble in ("moved-between", "moved-within", "late", "dead", "km/h", "circles")
    assert bool(vehicle.reasons) is refused


def test_a_fault_draws_its_vehicles_by_its_share():
    """In a small fleet a share is rounded to whole vehicles."""
    counts = [Counter(fleet._shares(np.random.default_rng(1), count)) for count in (10, 25, 200)]
    assert counts[0] == {"moved-between": 1, "moved-within": 1, "": 8}
    assert counts[1]["late"] == counts[1]["km/h"] == 1 and "cut" not in counts[1]
    names = ["dies", "circles", "garbage", "empty", "cut", "missing"]
    assert [counts[2][name] for name in names] == [4] * 6 and counts[2]["moved-within"] == 12
    assert [counts[2][name] for name in ("late", "dead", "km/h")] == [6] * 3


@pytest.mark.parametrize(("share", "apart_days", "lasts"), [(0.0, 0.1, 0.85), (1.0, 1.5, 1.2)])
def test_drives_are_a_tenth_to_one_and_a_half_days_apart(drives, tmp_path, share, apart_days, lasts):
    """The mount moves from 40 to 60 % of a drive."""
    for trouble in ("moved-between", "moved-within"):
        (tmp_path / trouble).mkdir()
        made = fleet._vehicle(Fixed(share), tmp_path / trouble, 0, trouble, 100.0, 25.0)
        assert made.moved_deg == pytest.approx(40.0 if share else 5.0)
    first, second, *_ = (start_s for *_, start_s, _ in drives)
    assert second - first == pytest.approx(apart_days * 86_400.0)
    assert made.moved_log == 0 and made.moved_s == pytest.approx((0.4 + 0.2 * share) * drives[-1][1].time[-1], abs=0.06)
    assert 100.0 * lasts - 12.0 < drives[-1][1].time[-1] < 100.0 * lasts + 60.0
    assert drives[-1][3].late_s == pytest.approx(1.2 * share)


def test_a_receiver_has_one_two_or_five_values_per_second(drives, tmp_path):
    fleet.make_fleet(tmp_path, 24, 1, 20.0, troubles=["circles"] * 24)
    assert {receiver.every_s for *_, receiver, _, _ in drives} == {0.2, 0.5, 1.0}


def test_a_missing_log_does_not_stay_from_an_earlier_fleet(drives, tmp_path):
    (there,) = fleet.make_fleet(tmp_path, 1, 1, 20.0, troubles=["circles"])
    assert there.paths[0].exists()
    (missing,) = fleet.make_fleet(tmp_path, 1, 1, 20.0, troubles=["missing"])
    assert missing.paths[0] == there.paths[0] and not missing.paths[0].exists()


def test_times_have_three_decimals():
    one = np.ones((2, 3))
    content = fleet.log_bytes(Log(np.array([0.0, 0.0123]), one, one, name="x"))
    assert content.splitlines()[2] == b"0.012,1,1,1,1,1,1,,"


def test_a_missing_library_of_a_fleet_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"a fleet needs pyarrow: .*\[fleet\]"):
        fleet.log_bytes(Log(np.array([0.0, 1.0]), np.ones((2, 3)), np.ones((2, 3))))


def test_a_full_disk_is_reported(drives, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(fleet, "_write", full)
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        fleet.make_fleet(tmp_path, 1, 1, 20.0, troubles=[""])


def test_a_folder_that_cannot_be_written_is_named(drives, tmp_path):
    (tmp_path / "drives").write_text("")
    with pytest.raises(InputError, match="drives"):
        fleet.make_fleet(tmp_path, 1)
