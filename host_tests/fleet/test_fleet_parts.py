"""Single steps of the fleet with known results: alignments from forces, means of two alignments, tables, files, axes of
a picture, and the signals of a day."""

from math import cos, radians, sin
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as parquet
import pytest
from kickstand.units import GAP_US
from kickstand_fleet import evidence, files, forward, moved, run, signals, tables
from kickstand_fleet.manifest import Period
from kickstand_fleet.period import failed
from kickstand_fleet.show import page, panel
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs.log import Log
from made_fleet import drive, turn_of
from support import command

UP = (0.0, 1.0, 0.0)
GAP_S = GAP_US * 1e-6
MOUNT = turn_of(50.0, (1.0, 2.0, 3.0))  # rotation from the sensor's axes to left, up, forward


def coefficients(left_g=1.0):
    """Return level, forward and left as fits() finds them with this mount."""
    return np.array([MOUNT[1], MOUNT[2], left_g * MOUNT[0], np.zeros(3)])


@pytest.mark.parametrize("varied", [(1.0, 0.0), (0.0, 1.0), (0.3, 2.0)])
def test_braking_or_bends_show_forward(varied):
    assert evidence.frames(coefficients(), np.array(varied)) == pytest.approx(MOUNT, abs=1e-12)
    assert evidence.frames(2.0 * coefficients(), np.array(varied)) == pytest.approx(MOUNT, abs=1e-12)


def test_a_frame_keeps_up_and_turns_forward_into_the_level():
    ahead = 2.0 * MOUNT[2] + 0.7 * MOUNT[1]
    assert evidence.frame_of(MOUNT[1], ahead) == pytest.approx(MOUNT, abs=1e-12)
    many = evidence.frame_of(np.tile(MOUNT[1], (3, 1)), np.tile(ahead, (3, 1)))
    assert many.shape == (3, 3, 3) and many[2] == pytest.approx(MOUNT, abs=1e-12)


@pytest.mark.parametrize(("left_g", "bends", "ratio"), [(0.9, 1.0, 0.9), (-1.0, 1.0, -1.0), (1.0, 0.04, 0.0)])
def test_handedness_divides_measured_by_computed_force(left_g, bends, ratio):
    assert evidence.handedness(coefficients(left_g), np.array([1.0, bends])) == pytest.approx(ratio)


@pytest.mark.parametrize("direction_deg", [0.0, 30.0, -60.0, 89.0])
def test_direction_of_sway_counts_from_forward_to_left(direction_deg):
    along = cos(radians(direction_deg)) * MOUNT[2] + sin(radians(direction_deg)) * MOUNT[0]
    sway = np.outer(along, along) + 0.2 * np.eye(3) + 5.0 * np.outer(MOUNT[1], MOUNT[1])
    found = evidence.sway_deg(np.array([sway, 3.0 * sway]), MOUNT)
    assert found == pytest.approx([direction_deg, direction_deg])


def test_normal_equations_give_coefficients_and_variation():
    rng = np.random.default_rng(1)
    terms = np.column_stack((np.ones(400), rng.normal(size=(400, 2))))
    truth = rng.normal(size=(3, 3))
    found, varied = evidence.fits(terms.T @ terms, terms.T @ (terms @ truth))
    assert found == pytest.approx(truth, abs=1e-5)
    assert varied == pytest.approx(400.0 * np.var(terms[:, 1:], axis=0))
    both, _ = evidence.fits(np.stack([terms.T @ terms] * 2), np.stack([terms.T @ (terms @ truth)] * 2))
    assert both[1] == pytest.approx(found)


def test_logs_without_intervals_have_no_blocks():
    none = evidence.blocks([])
    assert (none.square.shape, none.product.shape, none.sway.shape) == ((0, 4, 4), (0, 4, 3), (0, 3, 3))
    assert len(none.log) == len(none.t_s) == len(none.end_s) == 0
    assert moved.find_moves([]) == []


def test_blocks_last_eight_seconds_and_name_their_log():
    log, _ = drive(4, seconds=60.0)
    driven = evidence.intervals(log, "car", 0.0, np.zeros(3))
    whole = evidence.blocks([driven, driven])
    assert set(whole.log) == {0, 1}
    lengths = np.diff(whole.t_s[whole.log == 0])
    assert np.all(np.abs(lengths - 8.0) < 1.1)
    assert np.all(whole.end_s >= whole.t_s) and np.all(whole.end_s - whole.t_s < 8.0)
    assert np.trace(whole.sway, axis1=1, axis2=2).max() == pytest.approx(1.0)


@pytest.mark.parametrize(("missing_s", "used"), [(0.0, True), (GAP_S, False)])
def test_an_interval_needs_nine_tenths_of_its_samples(missing_s, used):
    log, _ = drive(41, seconds=60.0)
    there = (log.t_s < 20.3) | (log.t_s > 20.3 + missing_s)
    part = Log(log.t_s[there], log.accel_g[there], log.gyro_dps[there], log.speed_mps[there], name="with a gap")
    found = evidence.intervals(part, "car", 0.0, np.zeros(3))
    assert np.any(np.abs(found.t_s - 20.5) < 0.3) == used


def yawed(degrees):
    return turn_of(degrees, UP) @ MOUNT


def test_the_mean_of_two_alignments_is_weighted_by_variance():
    """Both methods use the same braking, so half of their errors are common. The mean of the two methods is therefore
    less exact than with independent errors."""
    sensor = forward.SENSOR_DEG**2
    frame, variance = forward._mean(yawed(1.0), 1.0, yawed(0.0), float(np.sqrt(1.0 - sensor)))
    assert frame == pytest.approx(yawed(0.5), abs=1e-6)
    assert variance == pytest.approx(0.75)
    frame, variance = forward._mean(yawed(1.0), 1.0, yawed(0.0), float(np.sqrt(4.0 - sensor)))
    assert frame == pytest.approx(yawed(0.8), abs=1e-4)
    assert variance == pytest.approx(0.64 + 0.04 * 4.0 + 2.0 * 0.2 * 0.8 * 0.5 * 2.0)


def test_alignments_that_contradict_each_other_are_less_exact():
    sensor = forward.SENSOR_DEG**2
    other = float(np.sqrt(1.0 - sensor))
    # The difference of the two yaws has a standard deviation of 1 degree
    _, agreeing = forward._mean(yawed(2.0), 1.0, yawed(0.0), other)
    _, contradicting = forward._mean(yawed(6.0), 1.0, yawed(0.0), other)
    assert agreeing == pytest.approx(0.75)
    assert contradicting == pytest.approx(0.75 * 9.0, rel=1e-3)


@pytest.mark.parametrize(("sigma", "halves", "sure"), [(0.1, -0.1, True), (9.0, 0.0, False), (0.1, -9.0, False)])
def test_forward_is_sure_within_both_limits(sigma, halves, sure):
    assert forward.Forward(MOUNT, sigma, 1.0, halves).sure is sure


def test_a_move_is_described_by_its_angle_and_its_tilt():
    move = moved.Move(0, 1.0, np.array([3.0, 12.0, 4.0]), np.array([1.0, 2.0, 1.0]))
    assert move.angle_deg == pytest.approx(13.0)
    assert move.tilt_deg == pytest.approx(5.0)
    assert move.sigmas == pytest.approx(np.sqrt(9.0 + 36.0 + 16.0))
    assert move.angle_sigma_deg == pytest.approx(np.sqrt(9.0 + 576.0 + 16.0) / 13.0)


def made_log(start_utc_s):
    count = 300
    t_s = np.linspace(0.0, 29.9, count)
    force = np.tile(MOUNT[1] + 0.5 * MOUNT[2], (count, 1))
    rates = np.tile(10.0 * MOUNT[0], (count, 1))
    utc_s = np.full(count, np.nan) if start_utc_s is None else start_utc_s + t_s
    return Log(t_s, force, rates, np.full(count, 7.0), utc_s=utc_s, name="a/drive 1.csv.gz")


def test_signals_are_along_vehicle_axes_in_one_file_per_day(tmp_path):
    calibration = CalibrationFile(vehicle_from_sensor=MOUNT, aligned=True)
    period = Period("bus 12", "front", "car", ())
    midnight = 20_000 * 86_400.0
    paths = signals.write(str(tmp_path), period, made_log(midnight - 9.95), calibration)
    assert [Path(path).parent.name for path in paths] == ["day=2024-10-03", "day=2024-10-04"]
    assert {Path(path).parent.parent.name for path in paths} == {"vehicle=bus%2012"}
    assert len({Path(path).name for path in paths}) == 1 and "front%20drive%201" in paths[0]
    first, second = (parquet.ParquetFile(path).read().to_pydict() for path in paths)
    assert (len(first["t_s"]), len(second["t_s"])) == (100, 200)
    assert list(first) == list(signals.COLUMNS)
    assert second["t_s"][0] == pytest.approx(10.0) and second["utc_s"][0] == pytest.approx(midnight + 0.05)
    row = {name: values[0] for name, values in first.items()}
    assert [row[f"{axis}_g"] for axis in ("left", "up", "forward")] == pytest.approx([0.0, 1.0, 0.5], abs=1e-6)
    assert [row[f"about_{axis}_dps"] for axis in ("left", "up", "forward")] == pytest.approx([10.0, 0.0, 0.0], abs=1e-5)
    assert row["speed_mps"] == 7.0
    schema = parquet.read_schema(paths[0])
    assert schema.field("t_s").type == "double" and schema.field("up_g").type == "float"
    (path,) = signals.write(str(tmp_path), period, made_log(None), calibration)
    assert Path(path).parent.name == "day=unknown"
    assert parquet.ParquetFile(path).read().to_pydict()["utc_s"][0] is None


def test_tables_are_written_in_groups_with_their_units(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "_GROUP", 4)
    results = [failed(Period(f"v{k}", "", "car", ()), "unreadable", "x") for k in range(10)]
    tables.write_tables(str(tmp_path), iter(results))
    assert sorted(path.stem for path in tmp_path.iterdir()) == sorted(tables.TABLES)
    whole = parquet.read_table(tmp_path / "alignments.parquet")
    assert whole.column("vehicle").to_pylist() == [f"v{k}" for k in range(10)]
    assert whole.schema.field("quality_deg").metadata[b"unit"] == b"deg"
    assert whole.schema.field("stops").type == "int32"
    with parquet.ParquetFile(tmp_path / "alignments.parquet") as file:
        groups = [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)]
    assert groups == [4, 4, 2]


@pytest.mark.parametrize(
    ("first", "last", "count", "values"),
    [
        (0.0, 10.0, 5, [0, 2, 4, 6, 8, 10]),
        (-0.21, 0.21, 4, [-0.2, 0.0, 0.2]),
        (0.0, 100.0, 4, [0, 50, 100]),
        (3.0, 3.0, 4, [3.0]),
        (0.5, 4.5, 4, [1, 2, 3, 4]),
    ],
)
def test_ticks_are_round_and_within_the_axis(first, last, count, values):
    assert panel.ticks(first, last, count) == values


def test_a_day_is_that_of_universal_time():
    assert [panel.date_text(utc_s) for utc_s in (0.0, 86_399.0, 1.79e9)] == ["1970-01-01", "1970-01-01", "2026-09-21"]


def test_a_file_is_read_up_to_its_limit(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    assert files.read_bytes(str(tmp_path / "a"), 5) == b"12345"
    with pytest.raises(InputError, match="is too large"):
        files.read_bytes(str(tmp_path / "a"), 4)
    with pytest.raises(InputError, match="cannot be read"):
        files.read_bytes(str(tmp_path))
    files.write_bytes(str(tmp_path / "new" / "b"), b"x")
    assert files.matches(f"{tmp_path}/**/[ab]") == [str(tmp_path / "a"), str(tmp_path / "new" / "b")]
    with files.to_write(str(tmp_path / "c.csv")) as temporary:
        temporary.write_text("c")
    assert (tmp_path / "c.csv").read_text() == "c"


def test_a_store_works_as_a_directory_does():
    base = "memory://fleet-parts"
    files.write_bytes(f"{base}/a", b"12345")
    with files.to_write(f"{base}/b.csv") as temporary:
        temporary.write_text("b")
    assert files.read_all([f"{base}/b.csv", f"{base}/a"]) == [b"b", b"12345"]
    assert files.read_bytes(f"{base}/a", 5) == b"12345"
    with pytest.raises(InputError, match="is too large"):
        files.read_bytes(f"{base}/a", 4)
    with pytest.raises(InputError, match="there is no such file"):
        files.read_bytes(f"{base}/none")
    with pytest.raises(InputError, match=r"^nothing://a: Protocol not known"):
        files.read_bytes("nothing://a")
    assert set(files.listed(base)) == {"memory:///fleet-parts/a", "memory:///fleet-parts/b.csv"}
    assert files.listed("memory://nowhere") == {}
    assert files.matches(f"{base}/*.csv") == ["memory:///fleet-parts/b.csv"]


def seen_rows(*rows):
    """Return a Glance of these results. A row changes the alignment of a result, and may have lists of its tables."""
    glance = page.Glance()
    for changed in rows:
        result = failed(Period(changed.pop("vehicle"), "", "car", ()), "unreadable", "x")
        result.errors = changed.pop("errors", [])
        result.moved, result.brake_tests = changed.pop("moved", []), changed.pop("brake_tests", [])
        result.alignment |= {"status": "aligned", "reason": "", "driven_s": 1800.0, "quality_deg": 0.5} | changed
        glance.add(result)
    return glance


def test_the_page_counts_results_and_names_the_worst():
    glance = seen_rows(
        {"vehicle": "/a/b/1", "quality_deg": 0.4, "moved": [{"turned_deg": 4.0}, {"turned_deg": 9.0}]},
        {"vehicle": "/a/bc/2", "quality_deg": 1.2, "brake_tests": [{"utc_s": None, "mfdd_mps2": 5.0}]},
        {"vehicle": "/a/b/3", "status": "refused", "reason": "mount-moved"},
        {
            "vehicle": "/a/b/4",
            "status": "error",
            "reason": "unreadable",
            "errors": [{"vehicle": "4", "log": "", "message": "gone"}],
        },
    )
    assert (glance.count, glance.driven_s, glance.below) == (4, 7200.0, "/a/")
    assert glance.statuses == {"aligned": 2, "refused": 1, "error": 1}
    assert glance.reasons == {("refused", "mount-moved"): 1, ("error", "unreadable"): 1}
    assert (glance.moved_count, glance.moved_vehicles, glance.errors) == (2, 2, 1)
    assert glance.first_errors == [("4", "gone")]
    assert [row["quality_deg"] for row in glance.worst] == [1.2, 0.4]
    assert [move["turned_deg"] for move, _ in glance.moved] == [9.0, 4.0]
    assert np.isnan(glance.decelerations[0][0]) and list(glance.decelerations[1]) == [5.0]


def test_medians_are_those_of_each_stretch_of_time():
    day = 86_400.0
    dated = [(0.1 * day, 3.0), (0.2 * day, 9.0), (0.9 * day, 4.0), (2.5 * day, 7.0)]
    assert page._medians(dated, day) == [(0.5 * day, 4.0), (2.5 * day, 7.0)]
    assert page._share(1, 3) == "33 %" and page._share(0, 0) == "--"


@pytest.mark.parametrize(("values", "pictures"), [([], 0), ([5.0], 1), ([5.0, 6.0], 2)])
def test_decelerations_are_drawn_over_time_if_two_have_a_date(values, pictures):
    times = [1.79e9 + 1000.0 * k for k in range(len(values))]
    assert len(page._braking(times, values)) == pictures
    assert len(page._braking([float("nan")] * len(values), values)) == min(1, pictures)


@pytest.mark.parametrize(("count", "more"), [(1, False), (2, True)])
def test_the_command_counts_and_names_the_first_errors(count, more, tmp_path, monkeypatch):
    manifest = tmp_path / "MANIFEST.csv"
    manifest.write_text("vehicle,path,kind\n1,a.csv,car\n")
    glance = seen_rows(
        {"vehicle": "1", "brake_tests": [{"utc_s": None, "mfdd_mps2": 5.0}]},
        {"vehicle": "2", "status": "error", "reason": "unreadable", "errors": [{"log": "a.csv", "message": "gone"}]},
    )
    glance.errors = count
    found = SimpleNamespace(vehicles=5, new=2, damaged=1, seen=glance)
    asked = []
    monkeypatch.setattr(run, "run_fleet", lambda periods, out, **how: asked.append((len(periods), out, how)) or found)
    done = command.works("fleet", manifest, "--out", "results", "--workers", 3, "--signals")
    assert done.out.splitlines()[:5] == [
        "mounted sensors: 5, 3 of them finished earlier",
        "aligned: 1, refused: 0, errors: 1",
        "      1  error: unreadable",
        f"mounts that seem to have moved: 0; brake tests: 1; rows of errors: {count}",
        "error: a.csv: gone",
    ]
    assert ("more errors are in errors.parquet" in done.out) is more
    assert done.err.startswith("1 earlier results were damaged")
    ((periods, out, how),) = asked
    assert (periods, out, how["workers"], how["with_signals"], how["timeout_s"]) == (1, "results", 3, True, 600.0)
