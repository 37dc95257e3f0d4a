"""Tests valid manifests, and the refusals by `kickstand fleet` and `kickstand simulate --fleet`."""

import pytest
from kickstand_fleet.manifest import Period, by_pattern, is_pattern, read_manifest
from kickstand_tools.common.errors import InputError
from made_fleet import TROUBLES
from support import command


def manifest(tmp_path, text):
    path = tmp_path / "MANIFEST.csv"
    path.write_text(text)
    return str(path)


def test_rows_of_a_vehicle_and_mount_are_one_period(tmp_path):
    (tmp_path / "logs").mkdir()
    for name in ("b.csv", "a.csv"):
        (tmp_path / "logs" / name).touch()
    text = "kind,vehicle,mount,path\ncar,1,,x.csv\nmotorcycle,2,,/y.csv\ncar,1,second,s3://store/z.csv\n\ncar,1,,logs/*.csv\n"
    logs = tmp_path / "logs"
    assert read_manifest(manifest(tmp_path, text)) == [
        Period("1", "", "car", (f"{tmp_path}/x.csv", f"{logs}/a.csv", f"{logs}/b.csv")),
        Period("2", "", "motorcycle", ("/y.csv",)),
        Period("1", "second", "car", ("s3://store/z.csv",)),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no column vehicle"),
        ("vehicle,path\n", "no column kind"),
        ("vehicle,path,kind\n", "has no vehicles"),
        ("vehicle,path,kind\n1,a.csv,bus\n", "line 2: kind is 'bus', it is motorcycle or car"),
        ("vehicle,path,kind\n1,a.csv,car\n1,b.csv,motorcycle\n", "line 3: 1 is a car in an earlier line"),
        ("vehicle,path,kind\n1,a.csv,car\n1,a.csv,car\n", "line 3: .* is given twice for 1"),
        ("vehicle,path,kind\n1,,car\n", "line 2: vehicle and path must not be empty"),
        ("vehicle,path,kind\n1,a.csv\n", "line 2: 2 cells, the first line has 3"),
    ],
)
def test_bad_manifest_is_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read_manifest(manifest(tmp_path, text))


def test_pattern_makes_each_file_a_vehicle(tmp_path):
    for name in ("2.csv", "1.csv"):
        (tmp_path / name).touch()
    pattern = f"{tmp_path}/*.csv"
    assert is_pattern(pattern) and not is_pattern("s3://store/MANIFEST.csv")
    assert [(p.vehicle, p.kind) for p in by_pattern(pattern, "car")] == [
        (f"{tmp_path}/1.csv", "car"),
        (f"{tmp_path}/2.csv", "car"),
    ]


def test_the_command_refuses_in_one_line_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("kickstand_fleet.cluster._REMOTE_PATIENCE_S", 0.5)
    good = manifest(tmp_path, "vehicle,path,kind\n1,a.csv,car\n")
    (tmp_path / "file").touch()
    out = tmp_path / "out"
    for arguments, words in (
        ((tmp_path / "none.csv", "--out", out), "none.csv: there is no such file"),
        ((f"{tmp_path}/*.txt", "--out", out), "matches no file"),
        ((good, "--out", tmp_path / "file"), "is a file: give --out the name of a directory"),
        ((good, "--out", out, "--scheduler", "tcp://127.0.0.1:9"), "no workers at tcp://127.0.0.1:9"),
        ((good, "--out", out, "--scheduler", "nonsense://x"), "no workers at nonsense://x"),
        (("gone://store/MANIFEST.csv", "--out", out), "gone://store/MANIFEST.csv"),
        ((tmp_path, "--out", out), f"is a directory: give {tmp_path}/MANIFEST.csv, or a pattern"),
        (("1.csv", "2.csv", "--out", out), "One manifest, or one pattern in quotation marks"),
    ):
        command.refused(tmp_path, "fleet", *arguments, words=words)


def test_simulated_fleet_matches_its_truth(fleet, tmp_path):
    assert [made.trouble for made in fleet.vehicles] == TROUBLES
    periods = {period.vehicle: period for period in read_manifest(str(fleet.manifest))}
    for made in fleet.vehicles:
        assert periods[made.name].paths == tuple(str(path) for path in made.paths)
        assert periods[made.name].kind == ("motorcycle" if made.kind == "motorcycle" else "car")
    said = command.works("simulate", "--fleet", 1, "--seed", 5, "--out", tmp_path / "made").out
    assert "1 vehicles, " in said and (tmp_path / "made" / "TRUTH.csv").is_file()
    again = command.works("simulate", "--fleet", 1, "--seed", 5, "--out", tmp_path / "again")
    assert again.status == 0
    for path in sorted((tmp_path / "made" / "drives").iterdir()):
        assert path.read_bytes() == (tmp_path / "again" / "drives" / path.name).read_bytes()
    assert "Missing option '--profile'" in command.run("simulate", "--out", tmp_path / "x").err
