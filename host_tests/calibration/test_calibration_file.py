"""Which contents of a CAL.json are accepted, and what they mean. Faulty files and harmful outputs are refused."""

import io
import json
from array import array

import numpy as np
import pytest
from kickstand.calibration.parameters import Transform
from kickstand_tools.calibration.file import CalibrationFile, calibration_path, read_calibration, write_calibration
from kickstand_tools.common.messages import InputError
from kickstand_tools.replay.replay_engine import ReplayMeter
from support import command

I = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]  # noqa: E741 - the usual name of the identity
TURNED = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
ZERO = [[0] * 3] * 3


def read(**changed):
    """Read the file of a neutral calibration with these entries changed; None leaves an entry out."""
    data = CalibrationFile().as_json() | changed
    return read_calibration(io.StringIO(json.dumps({key: value for key, value in data.items() if value is not None})))


def corner(value, base=I):
    """Return the matrix with another first entry."""
    return [[value, *base[0][1:]], *base[1:]]


@pytest.mark.parametrize(
    ("entry", "good", "bad", "words"),
    [
        ("version", 1, None, "version is missing"),
        ("version", 1, 2, "version 2"),
        ("version", 1, True, "version"),
        ("accel_offset_g", [0, 0, -0.499], [0, 0.5, 0], "offset of y is 0.5 g"),
        ("accel_offset_g", [0, 0, 0], None, "accel_offset_g is missing"),
        ("accel_offset_g", [0, 0, 0], [0, 0, True], "accel_offset_g"),
        ("accel_offset_g", [0, 0, 0], [float("nan"), 0, 0], "accel_offset_g has nan"),
        ("accel_offset_g", [0, 0, 0], [10**400, 0, 0], "accel_offset_g has 1000"),
        ("accel_slope", [0.801, 1.199, 1], 1.0, "accel_slope must be 3 numbers"),
        ("accel_slope", [0.81, 1, 1], [1, 1, 1.2], "slope of z is 1.2"),
        ("accel_slope", [0.81, 1, 1], [0.8, 1, 1], "slope of x is 0.8"),
        ("gyro_bias_dps", [59.9, 0, -59.9], [0, 0, -60.0], "gyro bias of z is -60 deg/s"),
        ("trim_deg", -3.6, -4, "trim_deg is -4"),
        ("trim_deg", 3.6, 3.61, "trim_deg"),
        ("trim_deg", 0, "none", "trim_deg is 'none'"),
        ("gyro_delay_s", 0.05, 0.051, "gyro_delay_s"),
        ("gyro_delay_s", 0, True, "gyro_delay_s"),
        ("accel_matrix", corner(1.15), corner(1.151), "accel_matrix"),
        ("accel_matrix", I, [1.0, 1.0, 1.0], "accel_matrix, row 1, must be 3 numbers"),
        ("gyro_matrix", [[1, -0.15, 0], *I[1:]], corner(1.3), "gyro_matrix is 0.3 from the identity"),
        ("gyro_matrix", I, I[:2], "gyro_matrix must be 3 rows of 3 numbers"),
        ("gyro_sigma", corner(0.05, ZERO), corner(0.051, ZERO), "gyro_sigma must be 0 to 0.05"),
        ("gyro_sigma", ZERO, corner(-1e-9, ZERO), "gyro_sigma must be 0 to 0.05"),
        ("vehicle", "car", "bus", "vehicle"),
        ("kickstand_side", "left", "top", "kickstand_side"),
        ("vehicle_from_sensor", corner(0.9995), corner(0.99), "no rotation"),
        ("vehicle_from_sensor", TURNED, [*I[:2], [0, 0, -1]], "no rotation"),
        ("vehicle_from_sensor", TURNED, [[1, 0.01, 0], *I[1:]], "no rotation"),
        ("vehicle_from_sensor", TURNED, [I[0], [0, 1], I[2]], "vehicle_from_sensor, row 2,"),
    ],
)
def test_each_entry_of_a_calibration_has_its_limit(entry, good, bad, words):
    read(**{entry: good})
    with pytest.raises(InputError, match=words):
        read(**{entry: bad})


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"version = 1",
        b'{"version": 1, "accel_off',
        b"[1, 2]",
        b"[" * 100_000,
        b'{"version": ' + b"1" * 5000 + b"}",
    ],
    ids=["empty", "not JSON", "cut", "a list", "deep", "many digits"],
)
def test_other_files_are_refused_by_name(tmp_path, content):
    cal = tmp_path / "CAL.json"
    cal.write_bytes(content)
    log = command.still(tmp_path / "log.csv", (0, 0, 1))
    command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv", words="CAL.json")


def test_a_directory_a_missing_and_a_huge_file_are_refused(tmp_path):
    (tmp_path / "huge.json").write_bytes(b" " * 1_000_001)
    for name, words in (
        ("", "directory"),
        ("none.json", "make it with kickstand calibrate"),
        ("huge.json", "too large"),
    ):
        with pytest.raises(InputError, match=words):
            read_calibration(tmp_path / name)


def complete():
    """Return a calibration with a value in each entry."""
    return CalibrationFile(
        np.array([0.01, -0.02, 0.03]),
        np.array([1.01, 0.99, 1.02]),
        np.array([3.0, -2.0, 1.0]),
        np.array([[0.0, 0.6, -0.8], [1.0, 0.0, 0.0], [0.0, -0.8, -0.6]]),
        aligned=True,
        six_done=True,
        trim_deg=-1.25,
        notes={"mine": [1]},
        vehicle="motorcycle",
        kickstand_side="right",
        gyro_delay_s=0.0,
        accel_matrix=np.array([[1.0, 0.01, -0.02], [0.01, 1.0, 0.003], [-0.02, 0.003, 1.0]]),
        gyro_matrix=np.array([[1.02, 0.01, 0.02], [-0.03, 0.98, 0.004], [0.005, -0.006, 1.01]]),
        gyro_sigma=np.full((3, 3), 0.004),
    )


def test_a_written_file_reads_back_the_same(tmp_path):
    write_calibration(tmp_path / "CAL.json", complete())
    (tmp_path / "BOM.json").write_bytes(b"\xef\xbb\xbf" + (tmp_path / "CAL.json").read_bytes())
    for name in "CAL.json", "BOM.json":
        cal = read_calibration(tmp_path / name)
        assert cal.as_json() | {"mine": [1]} == complete().as_json()
        assert CalibrationFile(cal.accel_offset_g) != CalibrationFile()
        assert (cal.vehicle, cal.kickstand_side, cal.gyro_delay_s) == ("motorcycle", "right", 0.0)
        assert cal.trim_deg == -1.25
    data = json.loads((tmp_path / "CAL.json").read_text())
    assert (data["version"], data["mine"]) == (1, [1])
    assert data["vehicle_from_sensor"] == complete().vehicle_from_sensor.tolist()


def test_entries_without_a_value_are_left_out():
    keys = "version accel_offset_g accel_slope gyro_bias_dps vehicle_from_sensor six_positions aligned trim_deg"
    assert set(CalibrationFile().as_json()) == set(keys.split())


def test_a_rides_calibration_is_beside_it(tmp_path):
    assert calibration_path(tmp_path / "RIDE.csv.gz") == tmp_path / "RIDE.cal.json"


def test_a_calibration_is_applied_alike_by_numpy_and_by_the_firmware():
    c, reading = complete(), np.array([0.3, -0.5, 0.8, 25.0, 50.0, -30.0, 70.0])
    force = c.accel_matrix @ (c.accel_slope * reading[:3] + c.accel_offset_g)
    rate = c.gyro_matrix @ (reading[4:] - c.gyro_bias_dps)
    in_vehicle = c.vehicle_from_sensor @ force, c.vehicle_from_sensor @ rate
    for values, right in zip(c.in_vehicle(reading[None]), in_vehicle, strict=True):
        assert values[0] == pytest.approx(right)
    meter = ReplayMeter(c.to_firmware())
    meter.update(reading.tolist(), 0)
    board = c.to_firmware()
    board.set_scale(4096, 65.5)
    sums = array("i", [round(v * lsb) for v, lsb in zip(reading, [4096] * 3 + [1] + [65.5] * 3)])
    of_vehicle, of_sensor = ([0.0] * 3, [0.0] * 3), ([0.0] * 3, [0.0] * 3)
    Transform(board).apply_sum(sums, 1, *of_vehicle)
    board.apply(sums, *of_sensor)
    for vectors in (meter.force, meter.rate), of_vehicle:
        assert list(vectors[0]) == pytest.approx(in_vehicle[0], abs=0.001)
        assert np.degrees(vectors[1]) == pytest.approx(in_vehicle[1], abs=0.1)
    assert of_sensor[0] == pytest.approx(force, abs=0.001)
    assert of_sensor[1] == pytest.approx(rate, abs=0.02)
