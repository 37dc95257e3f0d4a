"""Tests which files of a recording are read from a file, a folder or a zip."""

import gzip
import zipfile

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import files

TABLE = b"t,ax\n0,1\n"
NAMES = ["ride/A.csv", "ride/b.CSV.gz", "__MACOSX/._A.csv", "ride/.hidden.csv", "ride/photo.jpg"]


def content(name):
    return gzip.compress(TABLE) if name.endswith(".gz") else TABLE


def names(source):
    return sorted(file.name for file in files.read_files(source))


def test_of_a_zip_only_tables_that_are_not_hidden_are_read(tmp_path):
    """A folder whose name ends in .csv is not read as a table."""
    with zipfile.ZipFile(tmp_path / "r.zip", "w") as archive:
        archive.writestr("folder.csv/", b"")
        for name in NAMES:
            archive.writestr(name, content(name))
    assert names(tmp_path / "r.zip") == ["ride/A.csv", "ride/b.CSV.gz"]


def test_a_folder_is_read_as_a_zip_of_it(tmp_path):
    for name in NAMES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content(name))
    found = files.read_files(tmp_path)
    assert [(file.name, file.text, file.folder) for file in found if file.name == "ride/A.csv"] == [
        ("ride/A.csv", TABLE.decode(), "ride")
    ]
    assert names(tmp_path) == ["ride/A.csv", "ride/b.CSV.gz"]


def test_the_stem_of_a_name_has_no_folders_and_small_letters():
    assert files.RecordingFile("ride/Ride.CSV.gz", b"", "").stem == "ride"
    assert files.RecordingFile("Ride.csv", b"", "").folder == ""


def test_one_zip_in_a_folder_is_read_and_two_are_refused(tmp_path):
    for name in ("one.zip", "two.zip"):
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            archive.writestr("A.csv", TABLE)
        if name == "one.zip":
            assert names(tmp_path) == ["A.csv"]
    with pytest.raises(InputError, match=r"holds 2 zip files: give one of them, such as .*one\.zip"):
        names(tmp_path)
