"""Valid manifests, patterns, and refusals of the command in one line."""

import os

import pytest
from kickstand_fleet.manifest import Period, by_pattern, is_pattern, read_manifest
from kickstand_tools.common.messages import InputError
from support import command
from support.recordings import broken_logs


@pytest.fixture
def manifest(tmp_path):
    def write(content):
        (tmp_path / "MANIFEST.csv").write_bytes(content)
        return str(tmp_path / "MANIFEST.csv")

    return write


def test_rows_of_a_vehicle_and_mount_are_one_period(tmp_path, manifest):
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("b.csv", "a.csv"):
        (logs / name).touch()
    text = (
        b"kind,vehicle,mount,path\ncar,1,,x.csv\nmotorcycle,2,,/y.csv\ncar,1,second,s3://store/z.csv\n\n"
        b"car,1,,logs/*.csv\ncar,3,,none/*.csv\n"
    )
    assert read_manifest(manifest(b"\xef\xbb\xbf" + text)) == [
        Period("1", "", "car", (f"{tmp_path}/x.csv", f"{logs}/a.csv", f"{logs}/b.csv")),
        Period("2", "", "motorcycle", ("/y.csv",)),
        Period("1", "second", "car", ("s3://store/z.csv",)),
        Period("3", "", "car", (f"{tmp_path}/none/*.csv",)),  # the run reports that no file matches
    ]


def test_logs_are_beside_a_manifest_in_the_working_directory(manifest, monkeypatch, tmp_path):
    manifest(b"vehicle,path,kind\n1,a.csv,car\n")
    monkeypatch.chdir(tmp_path)
    assert read_manifest("MANIFEST.csv") == [Period("1", "", "car", ("a.csv",))]


HEADER = b"vehicle,path,kind\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no column vehicle"),
        (b"vehicle,path\n", "no column kind"),
        (HEADER, "has no vehicles"),
        (HEADER + b"1,a.csv,bus\n", "line 2: kind is 'bus', it is motorcycle or car"),
        (HEADER + b"1,a.csv,car\n1,b.csv,motorcycle\n", "line 3: 1 is a car in an earlier line"),
        (HEADER + b"1,a.csv,car\n1,a.csv,car\n", "line 3: .* is given twice for 1"),
        (HEADER + b"1,,car\n", "line 2: vehicle and path must not be empty"),
        (HEADER + b"1,a.csv\n", "line 2: 2 cells, the first line has 3"),
        (HEADER + b"\xff,a.csv,car\n", "is no table: a manifest starts with the line vehicle,path,kind"),
        (HEADER + b"x" * 200_000 + b",a,car\n", "is no table"),
    ],
)
def test_bad_manifest_is_refused(manifest, content, words):
    with pytest.raises(InputError, match=words):
        read_manifest(manifest(content))


def test_mutated_manifest_is_read_or_refused_in_one_line(manifest):
    content = b"vehicle,path,kind,mount\n" + b"".join(b"v%d,logs/%d.csv,car,m\n" % (k, k) for k in range(20))
    outcomes = set()
    for number in range(60):
        try:
            outcomes.add(bool(read_manifest(manifest(broken_logs.broken([content], number)[1]))))
        except InputError as error:
            assert "\n" not in str(error)
            outcomes.add(False)
    assert outcomes == {True, False}


def test_a_pattern_makes_each_file_a_vehicle(tmp_path):
    for name in ("2.csv", "1.csv"):
        (tmp_path / name).touch()
    assert [is_pattern(path) for path in ("a*", "a?", "a[1]", "a]", "s3://store/MANIFEST.csv")] == [1, 1, 1, 0, 0]
    paths = [f"{tmp_path}/1.csv", f"{tmp_path}/2.csv"]
    assert by_pattern(f"{tmp_path}/*.csv") == [Period(path, "", "car", (path,)) for path in paths]
    assert by_pattern(f"{tmp_path}/1*", "motorcycle") == [Period(paths[0], "", "motorcycle", (paths[0],))]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.csv", "--out", "out"), "none.csv: there is no such file"),
        (("*.txt", "--out", "out"), "*.txt matches no file"),
        (("MANIFEST.csv", "--out", "file"), "is a file: give --out the name of a directory"),
        (("MANIFEST.csv", "--out", "out", "--scheduler", "nonsense://x"), "no workers at nonsense://x"),
        (("gone://store/MANIFEST.csv", "--out", "out"), "gone://store/MANIFEST.csv"),
        ((".", "--out", "out"), "is a directory: give ./MANIFEST.csv, or a pattern"),
        (("1.csv", "2.csv", "--out", "out"), "One manifest, or one pattern in quotation marks"),
        (("pipe", "--out", "out"), "not an ordinary file"),
    ],
)
def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path, manifest, monkeypatch, arguments, words):
    manifest(HEADER + b"1,a.csv,car\n")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    os.mkfifo("pipe")
    command.refused(tmp_path, "fleet", *arguments, words=words)
    assert not (tmp_path / "out").exists()
