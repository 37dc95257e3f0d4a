"""Files, folders and zips: which files are read, and input that is too large, endless, damaged or not a recording."""

import gzip
import resource
import subprocess
import sys
import zipfile

import pytest
from kickstand_tools import api
from kickstand_tools.imports import files
from kickstand_tools.imports.files import read_files
from kickstand_tools.logs import csv_text
from support import command
from support.recordings import app_exports
from support.recordings.app_exports import riding

MB = 1_000_000
TABLE = b"t,ax\n0,1\n"
NAMES = ["ride/A.csv", "ride/b.CSV.gz", "__MACOSX/._A.csv", "ride/.hidden.csv", "ride/photo.jpg"]


def pack(path, contents):
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return path


def refused(directory, source, words, *more):
    return command.refused(directory, "import", source, "--out", directory / "RIDE.csv", *more, words=words)


def test_only_tables_that_are_not_hidden_are_read(tmp_path):
    """A folder is read as a zip of it. A folder whose name ends in .csv is not read as a table."""
    contents = {name: gzip.compress(TABLE) if name.endswith(".gz") else TABLE for name in NAMES}
    archive = pack(tmp_path / "r.zip", {"folder.csv/": b""} | contents)
    (tmp_path / "in" / "folder.csv").mkdir(parents=True)
    for name, content in contents.items():
        (tmp_path / "in" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "in" / name).write_bytes(content)
    for source in (archive, tmp_path / "in"):
        tables = sorted(read_files(source), key=lambda file: file.name)
        assert [(file.name, file.text) for file in tables] == [(name, TABLE.decode()) for name in NAMES[:2]]
        assert [(file.folder, file.stem) for file in tables] == [("ride", "a"), ("ride", "b")]
    (tmp_path / "export").mkdir()
    (tmp_path / "export" / "a.csv").symlink_to(archive)  # links out of a folder are not followed
    refused(tmp_path, tmp_path / "export", "contains no recording")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        *[("t,°\n1,2\n".encode(f"utf-{kind}"), "t,°\n1,2\n") for kind in ("8", "8-sig", "16", "16-le", "16-be")],
        (b"\xfe\xff\x00t", "t"), ("t,°\n".encode("cp1252"), "t,°\n"),
        (b"a\tb\r\nc\rd\r\r\r", "a\tb\nc\nd\n\n\n"),
        (b"\x00\x01\x02,1,2,3,4,5,6,7,8,9\n", "\0\1\2,1,2,3,4,5,6,7,8,9\n"),
    ],
)  # fmt: skip
def test_bytes_are_decoded_by_their_mark_or_their_zeros(tmp_path, content, text):
    (tmp_path / "a.csv").write_bytes(content)
    (file,) = read_files(tmp_path / "a.csv")
    assert file.text == text and file.first_lines(1) == [text.split("\n")[0]]


def damaged_zip(way):
    def write(directory):
        source = app_exports.into(directory / "p.zip", app_exports.phyphox(riding().every(8)))
        source.write_bytes(way(source.read_bytes()))

    return write


def locked(directory):
    content = bytearray(pack(directory / "p.zip", {"a.csv": TABLE}).read_bytes())
    for mark, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(mark) + offset] |= 1  # set the flag of an encrypted entry
    (directory / "p.zip").write_bytes(content)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.zip", None, "there is no such file"),
        ("p.zip", damaged_zip(lambda content: content[: len(content) // 10]), "p.zip is damaged or cut short: copy it"),
        ("p.zip", damaged_zip(lambda content: content[:-30]), "p.zip is damaged or cut short: copy it again"),
        ("p.zip", damaged_zip(lambda content: content[:2000] + bytes(50) + content[2050:]), "is damaged or cut"),
        ("p.zip", locked, "is packed with a password, or in another way: unpack it first"),
        ("p.zip", lambda folder: pack(folder / "p.zip", {"[Content_Types].xml": "x"}), "a table of Excel: export it"),
        ("a.csv.gz", b"\x1f\x8b\x08\x00\x00\x00\x00\x00", "a.csv.gz is damaged or cut short"),
        ("a.png", bytes(range(256)) * 4, "not text: give what an app has exported as CSV or VBO"),
        ("a.csv", b"\x01\x01\x01\x01,1,2,3,4,5,6,7,8,9\n", "not text"),
        ("a.csv", b"", "contains no recording: give the file, the folder or the zip that an app"),
        ("b.csv", b"Record,Time,Speed,GForceX,GForceY,GForceZ,GyroX,GyroY,GyroZ\n", "no rows under the names of the"),
        ("mk.py", b"import os\nprint('x')\n", "no table of sensors ('import os')"),
        ("old.xls", b"\xd0\xcf\x11\xe0" + bytes(600), "a table of Excel: export it as CSV"),
        ("a.csv", b"x" * 1_000_001, "a.csv: a line of over 1,000,000 characters"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_a_recording_is_refused(tmp_path, name, content, words):
    if callable(content):
        content(tmp_path)
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    refused(tmp_path, tmp_path / name, words)


def test_two_recordings_in_one_folder_are_refused(tmp_path):
    """One app in two folders, two apps in one folder, one app with two names, and two zips."""
    ride = riding().every(8)
    monday = app_exports.into(tmp_path / "all" / "monday", app_exports.phyphox(ride))
    app_exports.into(tmp_path / "all" / "tuesday", app_exports.phyphox(ride))
    refused(tmp_path, tmp_path / "all", "holds 2 recordings (monday, tuesday): give one of them")
    assert api.import_recording(monday).app == "phyphox"
    folder = app_exports.into(tmp_path / "in", {"a.csv": app_exports.racebox(ride), "b.vbo": app_exports.vbo(ride)})
    refused(tmp_path, folder, "holds 2 recordings (b.vbo, a.csv): give one of them")
    kinetics = app_exports.sensor_kinetics(ride)
    kinetics |= {name.replace("Ride", "Home"): text for name, text in kinetics.items()}
    refused(tmp_path, app_exports.into(tmp_path / "k", kinetics), "holds 2 recordings")


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as on Linux")
@pytest.mark.parametrize("name", ["b.csv.gz", pytest.param("b.zip", marks=pytest.mark.long)])
def test_a_zip_bomb_is_refused_within_1_gb_of_memory(tmp_path, name):
    part, parts = b"1,2,3\n" * MB, 48
    if name.endswith(".gz"):
        (tmp_path / name).write_bytes(gzip.compress(part, 9) * parts)
    else:
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.csv", "w") as file:
            for _ in range(parts):
                file.write(part)
    code = "from kickstand_tools.cli.main import main; main()"
    result = subprocess.run(
        [sys.executable, "-c", code, "import", str(tmp_path / name), "--out", str(tmp_path / "x.csv")],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1000 * MB, 1000 * MB)),
        check=False,
    )
    assert result.returncode == 2 and "too large: over 250 MB" in result.stderr


def test_too_many_files_or_cells_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MOST_FILES", 20)
    refused(tmp_path, pack(tmp_path / "many.zip", {f"{k}.csv": "a" for k in range(400)}), "over 20 files")
    (tmp_path / "in").mkdir()
    for k in range(21):
        (tmp_path / "in" / f"{k}.csv").touch()
    refused(tmp_path, tmp_path / "in", "over 20 files")
    monkeypatch.setattr(csv_text, "MOST_CELLS", 5_000)
    (tmp_path / "log.csv").write_text(app_exports.any_table(riding().every(4)))
    refused(tmp_path, tmp_path / "log.csv", "the table is too large")
