"""Tests which contents of a CAL.json are accepted and which are refused."""

import io
import json
import os
from array import array

import numpy as np
import pytest
from kickstand.calibration.transform import Transform
from kickstand_tools.calibration import file as calibration_file
from kickstand_tools.calibration.file import CalibrationFile, read_calibration, write_calibration
from kickstand_tools.common.errors import InputError
from kickstand_tools.replay.replay_engine import ReplayMeter
from support import command

I = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]  # noqa: E741 - the usual name of the identity

BAD = {
    "no version": ({"version": None}, "version is missing"),
    "version of tomorrow": ({"version": 2}, "version 2"),
    "no offset": ({"accel_offset_g": None}, "accel_offset_g is missing"),
    "slope a number": ({"accel_slope": 1.0}, "accel_slope must be 3 numbers"),
    "offset nan": ({"accel_offset_g": [float("nan"), 0, 0]}, "accel_offset_g has nan"),
    "offset very large": ({"accel_offset_g": [10**400, 0, 0]}, "accel_offset_g has 1000"),
    "offset too large": ({"accel_offset_g": [0, 0.5, 0]}, "offset of y is 0.5 g"),
    "bias too large": ({"gyro_bias_dps": [0, 0, -60.0]}, "gyro bias of z is -60 deg/s"),
    "short row": ({"vehicle_from_sensor": [[1, 0, 0], [0, 1], [0, 0, 1]]}, "vehicle_from_sensor, row 2,"),
    "mirrored": ({"vehicle_from_sensor": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "no rotation"),
    "trim a word": ({"trim_deg": "none"}, "trim_deg is 'none'"),
    "trim too large": ({"trim_deg": -4}, "trim_deg is -4"),
    "skewed": ({"vehicle_from_sensor": [[1, 0.01, 0], [0, 1, 0], [0, 0, 1]]}, "no rotation"),
}
BROKEN = {
    "empty": b"",
    "not JSON": b"version = 1",
    "cut": b'{"version": 1, "accel_off',
    "a list": b"[1, 2]",
    "deep": b"[" * 100_000,
    "many digits": b'{"version": ' + b"1" * 5000 + b"}",
}


@pytest.fixture
def log(tmp_path):
    return command.still(tmp_path / "log.csv", (0, 0, 1))


@pytest.mark.parametrize("name", BAD)
def test_a_bad_calibration_is_refused(tmp_path, log, name):
    changed, words = BAD[name]
    cal = command.write_cal(tmp_path / "CAL.json", **changed)
    out = tmp_path / "LEAN.csv"
    line = command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", out, words=words)
    assert "CAL.json" in line


@pytest.mark.parametrize("name", BROKEN)
def test_other_files_are_refused_as_calibrations(tmp_path, log, name):
    (tmp_path / "CAL.json").write_bytes(BROKEN[name])
    out = tmp_path / "LEAN.csv"
    command.refused(tmp_path, "replay", log, "--calibration", tmp_path / "CAL.json", "--out", out, words="CAL.json")


def test_a_directory_or_nothing_is_refused(tmp_path, log):
    for place in tmp_path, tmp_path / "none.json":
        command.refused(tmp_path, "replay", log, "--calibration", place, "--out", tmp_path / "LEAN.csv")


def test_a_written_file_reads_back_the_same(tmp_path):
    matrix = [0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0]
    written = CalibrationFile(
        np.array([0.012345678, -0.4, 0.0]),
        np.array([1.19, 0.81, 1.0]),
        np.array([1.5, -2.5, 59.0]),
        np.array(matrix),
        True,
        True,
        trim_deg=-1.25,
    )
    write_calibration(tmp_path / "CAL.json", written)
    got = read_calibration(tmp_path / "CAL.json")
    assert got.parameters() == written.parameters()
    assert (got.aligned, got.six_done, got.vehicle, got.kickstand_side) == (True, True, "", "")
    data = json.loads((tmp_path / "CAL.json").read_text())
    assert data["version"] == 1
    assert data["vehicle_from_sensor"] == [matrix[0:3], matrix[3:6], matrix[6:9]]


def test_a_byte_order_mark_is_accepted(tmp_path):
    cal = command.write_cal(tmp_path / "CAL.json")
    cal.write_bytes(b"\xef\xbb\xbf" + cal.read_bytes())
    assert read_calibration(cal).accel_slope.tolist() == [1.01, 0.99, 1.0]


def test_an_unlabelled_identity_is_not_an_alignment(tmp_path):
    """A file from another program may lack the key `aligned`. Only a matrix other than the identity is an alignment."""
    assert not read_calibration(command.write_cal(tmp_path / "CAL.json", vehicle_from_sensor=I)).aligned
    assert read_calibration(command.write_cal(tmp_path / "CAL.json", vehicle_from_sensor=I, aligned=True)).aligned


def test_a_write_that_fails_leaves_the_old_file_and_no_other(tmp_path, monkeypatch, log):
    cal = command.write_cal(tmp_path / "CAL.json")
    (tmp_path / "LEAN.csv").write_text("the one from yesterday\n")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    out = tmp_path / "LEAN.csv"
    command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", out, words="No space left")


def test_harmful_outputs_are_refused(tmp_path, log):
    cal = command.write_cal(tmp_path / "CAL.json")
    (tmp_path / "link.csv").symlink_to(log)
    for out, words in (
        (tmp_path, "is a directory"),
        (tmp_path / "none" / "LEAN.csv", "there is no directory"),
        (tmp_path / "link.csv", "is also an input"),
        (cal, "is also an input"),
    ):
        command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", out, words=words)


@pytest.mark.skipif(os.name == "nt", reason="named pipes are of Unix")
def test_a_special_file_is_not_replaced(tmp_path, log):
    """Without this refusal a user with enough rights could replace a special file such as /dev/null. The test uses its
    own pipe."""
    cal = command.write_cal(tmp_path / "CAL.json")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    command.refused(tmp_path, "replay", log, "--calibration", cal, "--out", pipe, words="ordinary file")
    assert pipe.is_fifo()


def test_a_link_is_written_through(tmp_path, log):
    """If the output is a link, the link stays and the file to which it points is updated."""
    (tmp_path / "kept").mkdir()
    (tmp_path / "LEAN.csv").symlink_to(tmp_path / "kept" / "LEAN.csv")
    cal = command.write_cal(tmp_path / "CAL.json")
    command.works("replay", log, "--calibration", cal, "--out", tmp_path / "LEAN.csv")
    assert (tmp_path / "LEAN.csv").is_symlink()
    assert (tmp_path / "kept" / "LEAN.csv").read_text().startswith("t_s,")


def whole():
    """Return a calibration with matrices and an alignment."""
    turned = np.array([[0.0, 0.6, -0.8], [1.0, 0.0, 0.0], [0.0, -0.8, -0.6]])
    return CalibrationFile(
        np.array([0.01, -0.02, 0.03]),
        np.array([1.01, 0.99, 1.02]),
        np.array([3.0, -2.0, 1.0]),
        turned,
        aligned=True,
        six_done=True,
        accel_matrix=np.array([[1.0, 0.01, -0.02], [0.01, 1.0, 0.003], [-0.02, 0.003, 1.0]]),
        gyro_matrix=np.array([[1.02, 0.01, 0.02], [-0.03, 0.98, 0.004], [0.005, -0.006, 1.01]]),
        gyro_sigma=np.full((3, 3), 0.004),
    )


def test_matrices_are_applied_alike_wherever_a_calibration_is(tmp_path):
    """The matrices of a calibration have the same effect when they are read from a file, in numpy, and in the
    firmware."""
    write_calibration(tmp_path / "CAL.json", whole())
    found = read_calibration(tmp_path / "CAL.json")
    assert found == whole()
    reading = np.array([[0.3, -0.5, 0.8, 25.0, 50.0, -30.0, 70.0]])
    c = whole()
    force = c.vehicle_from_sensor @ c.accel_matrix @ (c.accel_slope * reading[0, :3] + c.accel_offset_g)
    rate = c.vehicle_from_sensor @ c.gyro_matrix @ (reading[0, 4:] - c.gyro_bias_dps)
    for got, want in zip(found.in_vehicle(reading), (force, rate), strict=True):
        assert got[0] == pytest.approx(want)
    meter = ReplayMeter(found.to_firmware())
    meter.update(reading[0].tolist(), 0)
    assert meter.force == pytest.approx(force.tolist(), abs=1e-5)
    assert np.degrees(meter.rate) == pytest.approx(rate, abs=1e-3)
    board = found.to_firmware()
    board.set_scale(4096, 65.5)
    sums = array("i", [round(v * lsb) for v, lsb in zip(reading[0], [4096] * 3 + [1] + [65.5] * 3)])
    on_board = [0.0] * 3, [0.0] * 3
    Transform(board).apply_sum(sums, 1, *on_board)
    assert on_board[0] == pytest.approx(force.tolist(), abs=0.001)
    assert np.degrees(on_board[1]) == pytest.approx(rate, abs=0.1)
    sensor = [0.0] * 3, [0.0] * 3
    board.apply(sums, *sensor)
    assert c.vehicle_from_sensor @ sensor[0] == pytest.approx(force, abs=0.001)
    assert c.vehicle_from_sensor @ sensor[1] == pytest.approx(rate, abs=0.02)


def test_a_file_without_matrices_has_none_of_their_keys():
    assert not {"accel_matrix", "gyro_matrix", "gyro_sigma"} & set(CalibrationFile().as_json())


@pytest.mark.parametrize(
    ("entry", "value", "words"),
    [
        ("gyro_matrix", [[1.3, 0, 0], [0, 1, 0], [0, 0, 1]], "gyro_matrix is 0.3 from the identity"),
        ("accel_matrix", [1.0, 1.0, 1.0], "accel_matrix, row 1, must be 3 numbers"),
        ("gyro_matrix", [[1, 0, 0], [0, 1, 0]], "gyro_matrix must be 3 rows of 3 numbers"),
        ("gyro_sigma", [[-0.1] * 3] * 3, "gyro_sigma must be 0 to 0.05"),
    ],
)
def test_matrices_that_no_sensor_has_are_refused(tmp_path, entry, value, words):
    path = tmp_path / "CAL.json"
    path.write_text(json.dumps(whole().as_json() | {entry: value}))
    with pytest.raises(InputError, match=words):
        read_calibration(path)


def test_a_calibration_that_is_missing_or_too_large_is_refused(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="there is no such file: make it with kickstand calibrate"):
        read_calibration(tmp_path / "none.json")
    path = tmp_path / "A.json"
    write_calibration(path, CalibrationFile(accel_offset_g=np.array([0.01, 0.0, 0.0])))
    size = len(path.read_bytes())
    for most, good in ((size, True), (size - 1, False)):
        monkeypatch.setattr(calibration_file, "MOST_BYTES", most)
        for source in (path, io.StringIO(path.read_text())):
            if good:
                assert read_calibration(source).accel_offset_g[0] == 0.01
            else:
                with pytest.raises(InputError, match="too large for a calibration"):
                    read_calibration(source)
