"""Files on this computer and in a store: limits, marks of changed files, names, and failures in one line."""

import errno
import gzip
import os

import pytest
from kickstand_fleet import files, plot
from kickstand_tools.common.messages import InputError

LOG = b"t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n" + b"".join(b"%d,0,1,0,0,0,%d\n" % (k, k) for k in range(5))


def write_to(path):
    with files.to_write(path) as temporary:
        temporary.write_text("x")


@pytest.fixture(params=["disk", "memory", "failing"])
def base(request, tmp_path, store):
    """Return a directory on this computer or in a store."""
    return str(tmp_path) if request.param == "disk" else f"{request.param}:///{tmp_path.name}-{os.getpid()}"


def test_a_store_works_as_a_directory_does(base):
    files.write_bytes(f"{base}/new/deep/a.bin", b"12345")
    write_to(f"{base}/b.csv")
    assert files.read_bytes(f"{base}/new/deep/a.bin", 5) == b"12345"
    with pytest.raises(InputError, match="is too large: over 0 MB"):
        files.read_bytes(f"{base}/new/deep/a.bin", 4)
    with pytest.raises(InputError, match="there is no such file"):
        files.read_bytes(f"{base}/none")
    assert files.read_bytes(f"{base}/b.csv") == b"x"
    assert files.matches(f"{base}/*.csv") == [f"{base}/b.csv"] and files.matches(f"{base}/*.txt") == []
    marks = files.identities([f"{base}/b.csv", f"{base}/none", f"{base}/nowhere/c"])
    assert marks[f"{base}/b.csv"].startswith("1-") and list(marks.values())[1:] == ["", ""]
    for name, content in (("a.csv", LOG), ("a.csv.gz", gzip.compress(LOG))):
        files.write_bytes(f"{base}/{name}", content)
        log = files.open_log(f"{base}/{name}")
        assert (log.name, log.gyro_dps[:, 2].tolist()) == (f"{base}/{name}", [0, 1, 2, 3, 4])


@pytest.mark.parametrize("error", [FileNotFoundError("x"), PermissionError(errno.EACCES, "no\n  right")])
@pytest.mark.parametrize(
    ("action", "missing", "what"),
    [
        (files.read_bytes, "there is no such file", "read"),
        (files.matches, "there is no such file", "read"),
        (lambda path: files.write_bytes(path, b""), "cannot be written: there is no such place", "written"),
        (write_to, "cannot be written: there is no such place", "written"),
    ],
)
def test_a_failure_of_a_store_is_one_line(store, error, action, missing, what):
    store.fail("a.csv", error)
    with pytest.raises(InputError) as refusal:
        action("failing:///a.csv")
    absent = isinstance(error, FileNotFoundError)
    assert str(refusal.value) == f"failing:///a.csv{': ' + missing if absent else f' cannot be {what}: no right'}"


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("absent://a/b", "^absent://a/b: its library is not installed: no_such_library.Store import failed"),
        ("nothing://a", "^nothing://a: Protocol not known"),
    ],
)
def test_a_store_without_its_library_is_named(path, words):
    with pytest.raises(InputError, match=words):
        files.read_bytes(path)


NAMES = ["x" * 256, "x" * 257, 100 * "\u4e2d", "hid", ".hid", "..", "a/b", "con", "a%2Fb", "\x00", " ", "\u202e", "HID"]


@pytest.mark.parametrize(
    "names",
    [
        [plot.file_name(name, mount) for name in NAMES for mount in ("", "m")],
        [files.folder_value(name) for name in NAMES],
    ],
    ids=["pictures", "folders"],
)
def test_file_names_are_unique_and_portable(names):
    assert len(set(names)) == len(names)
    assert all(len(name.encode()) < 150 and name.isascii() and "/" not in name for name in names)
