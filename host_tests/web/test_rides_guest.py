"""The Python code of the page Rides, run on CPython."""

import json

import numpy as np
import pytest
from kickstand_tools.web import rides_guest
from support.recordings import analysis_rides, app_exports


def test_singular_matrix_is_detected_in_webassembly():
    silent = rides_guest.raising(lambda matrix: np.full_like(matrix, np.nan))
    with pytest.raises(np.linalg.LinAlgError):
        silent(np.zeros((3, 3)))
    assert np.all(np.isnan(silent(np.full((3, 3), np.nan))))  # for NaN as input, numpy returns NaN on every platform
    assert rides_guest.raising(np.linalg.inv)(2.0 * np.eye(2)).tolist() == [[0.5, 0.0], [0.0, 0.5]]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ("A.csv B.csv A.cal.json", {"A.csv": "A.cal.json", "B.csv": ""}),
        ("A.csv B.csv bike.json", {"A.csv": "bike.json", "B.csv": "bike.json"}),
        ("A.csv bike.json", {"A.csv": "bike.json"}),
        ("A.csv old.json new.json", {"A.csv": "new.json"}),
        ("ride-10.csv ride-9.csv bike.json", {"ride-9.csv": "bike.json", "ride-10.csv": "bike.json"}),
    ],
)
def test_calibration_of_another_ride_is_not_used(ride, tmp_path, monkeypatch, names, expected):
    found = rides_of(tmp_path, monkeypatch, {name: ride.read_text()[:500] for name in names.split()})
    assert list(found.items()) == list(expected.items())


def test_two_recordings_of_single_files_are_two_rides(tmp_path, monkeypatch):
    """Several files are one ride only if an app wrote them as one recording."""
    riding = app_exports.riding().every(4)
    parts = {name: text for name, text in app_exports.phyphox(riding).items() if "/" not in name}
    files = {"b.csv": app_exports.racechrono(riding), "a.csv": app_exports.racechrono(riding), **parts}
    names = ["a.csv", "b.csv", "phyphox recording"]
    assert list(rides_of(tmp_path, monkeypatch, files)) == names


def test_a_file_may_have_the_name_of_the_folder_of_recordings(tmp_path, monkeypatch):
    parts = {name: text for name, text in app_exports.phyphox(app_exports.riding().every(4)).items() if "/" not in name}
    found = rides_of(tmp_path, monkeypatch, {"phyphox recording": "no log", **parts})
    assert list(found) == ["phyphox recording_"]


def test_ride_that_exceeds_the_memory_is_reported():
    @rides_guest.in_json
    def too_much():
        raise MemoryError

    assert json.loads(too_much()) == {"refused": rides_guest.TOO_LONG}


def rides_of(tmp_path, monkeypatch, files):
    """Return {log: calibration} of the rides in these files. files: {name: text}."""
    for folder in ("given", "here"):
        (tmp_path / folder).mkdir()
    for name, text in files.items():
        text = json.dumps(analysis_rides.CALIBRATION) if name.endswith(".json") else text
        (tmp_path / "given" / name).write_text(text)
    monkeypatch.chdir(tmp_path / "here")  # the code deletes all other files in its working directory
    found = json.loads(rides_guest.rides(str(tmp_path / "given"), json.dumps(list(files))))
    return {one["log"]: one["calibration"] for one in found["rides"]}
