"""Files of a fleet with the library for stores replaced: sizes, marks of files, and messages of failures."""

import gzip
import io
import os

import fsspec
import pytest
from kickstand_fleet import files, manifest
from kickstand_fleet.manifest import Period, by_pattern, read_manifest
from kickstand_tools.common.errors import InputError

LOG = b"t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps\n" + b"".join(b"%d,0,1,0,0,0,%d\n" % (k, k) for k in range(5))


class Store:
    """Replaces a file system of fsspec. found: the entries that ls() returns. error: raised by every other method."""

    def __init__(self, found=(), error=None):
        self.found, self.error, self.forgotten = found, error, []

    def invalidate_cache(self, place):
        self.forgotten.append(place)

    def ls(self, place, detail):
        assert detail and self.forgotten.pop() == place  # an old listing would hide a changed file
        return self.found

    def unstrip_protocol(self, name):
        return f"store://{name}"

    def _fail(self, *_, **__):
        raise self.error or AssertionError

    cat_file = pipe_file = put_file = glob = _fail


def use(monkeypatch, store):
    monkeypatch.setattr(fsspec.core, "url_to_fs", lambda path: (store, path.partition("://")[2]))


@pytest.mark.parametrize(
    ("info", "mark"),
    [
        ({"ETag": "e", "mtime": "m", "LastModified": "l"}, "7-e"),
        ({"mtime": "m", "LastModified": "l"}, "7-m"),
        ({"LastModified": "l"}, "7-l"),
        ({}, "7-"),
    ],
)
def test_a_mark_has_the_etag_or_a_time(monkeypatch, info, mark):
    use(monkeypatch, Store([{"name": "a/b.csv", "size": 7} | info]))
    assert files.listed("store://a") == {"store://a/b.csv": mark}
    assert files.identities(["store://a/b.csv", "store://a/c.csv"]) == {"store://a/b.csv": mark, "store://a/c.csv": ""}


def written(path):
    with files.to_write(path) as temporary:
        temporary.write_text("x")


@pytest.mark.parametrize("error", [FileNotFoundError("x"), PermissionError(13, "no\n  right")])
@pytest.mark.parametrize(
    ("action", "missing", "what"),
    [
        (files.read_bytes, "there is no such file", "read"),
        (files.matches, "there is no such file", "read"),
        (lambda path: files.write_bytes(path, b""), "cannot be written: there is no such place", "written"),
        (written, "cannot be written: there is no such place", "written"),
    ],
)
def test_a_failure_of_a_store_is_one_line(monkeypatch, error, action, missing, what):
    use(monkeypatch, Store(error=error))
    with pytest.raises(InputError) as raised:
        action("store://a.csv")
    absent = isinstance(error, FileNotFoundError)
    said = f"store://a.csv: {missing}" if absent else f"store://a.csv cannot be {what}: no right"
    assert str(raised.value) == said


@pytest.mark.parametrize(("path", "package"), [("s3://a/b", "s3"), ("gcs://a/b", "fleet")])
def test_a_missing_library_of_a_store_is_named(monkeypatch, path, package):
    def missing(_):
        raise ImportError

    monkeypatch.setattr(fsspec.core, "url_to_fs", missing)
    with pytest.raises(InputError, match=rf"^{path}: its library is not installed: .*\[{package}\]"):
        files.read_bytes(path)


def test_a_log_of_a_store_is_read_with_its_name():
    for name, content in (("a.csv", LOG), ("a.csv.gz", gzip.compress(LOG))):
        files.write_bytes(f"memory://fleet-log/{name}", content)
        log = files.open_log(f"memory://fleet-log/{name}")
        assert (log.name, log.gyro_dps[:, 2].tolist()) == (f"memory://fleet-log/{name}", [0, 1, 2, 3, 4])


def test_a_log_on_this_computer_is_read_with_its_name(tmp_path):
    (tmp_path / "a.csv").write_bytes(LOG)
    assert files.open_log(str(tmp_path / "a.csv")).name == str(tmp_path / "a.csv")


def test_a_packed_log_may_have_300_million_bytes(monkeypatch):
    asked = []

    class File(io.BytesIO):
        def read(self, size: int | None = -1):
            asked.append(size)
            return b"x"

    monkeypatch.setattr(files, "open_input", lambda path: File())
    assert files.read_bytes("a.csv.gz") == b"x" and asked == [300_000_001]


def test_a_manifest_may_have_100_million_bytes(monkeypatch):
    asked = []
    monkeypatch.setattr(files, "read_bytes", lambda path, most: asked.append(most) or b"vehicle,path,kind\n1,a,car\n")
    read_manifest("MANIFEST.csv")
    assert asked == [100_000_000]


def test_a_directory_is_made_with_those_above_it(tmp_path):
    for name in ("1", "2"):
        files.write_bytes(str(tmp_path / "new" / "deep" / name), b"x")
    assert len(list((tmp_path / "new" / "deep").iterdir())) == 2
    with pytest.raises(InputError, match="deep/1/below cannot be made: Not a directory"):
        files.write_bytes(str(tmp_path / "new" / "deep" / "1" / "below" / "a"), b"x")


@pytest.mark.parametrize(
    ("path", "log"), [("MANIFEST.csv", "a.csv"), ("/MANIFEST.csv", "/a.csv"), ("x/MANIFEST.csv", "x/a.csv")]
)
def test_logs_are_beside_a_manifest_anywhere(monkeypatch, path, log):
    monkeypatch.setattr(files, "read_bytes", lambda *_: b"vehicle,path,kind\n1,a.csv,car\n")
    assert read_manifest(path) == [Period("1", "", "car", (log,))]


def test_a_pattern_without_files_stays_for_the_report(tmp_path):
    (tmp_path / "MANIFEST.csv").write_text("vehicle,path,kind\n1,none/*.csv,car\n")
    (period,) = read_manifest(str(tmp_path / "MANIFEST.csv"))
    assert period.paths == (f"{tmp_path}/none/*.csv",)
    assert [manifest.is_pattern(path) for path in ("a*", "a?", "a[1]", "a]")] == [True, True, True, False]


def test_a_file_that_is_no_text_is_no_manifest(tmp_path):
    for content in (b"vehicle,path,kind\n\xff,a.csv,car\n", b"vehicle,path,kind\n" + 200_000 * b"x" + b",a,car\n"):
        (tmp_path / "MANIFEST.csv").write_bytes(content)
        with pytest.raises(InputError, match="is no table: a manifest starts with the line vehicle,path,kind"):
            read_manifest(str(tmp_path / "MANIFEST.csv"))


def test_a_vehicle_of_a_pattern_has_a_printable_name(monkeypatch):
    monkeypatch.setattr(files, "matches", lambda pattern: ["a\udcff.csv"])
    assert by_pattern("*.csv", "motorcycle") == [Period("a\\udcff.csv", "", "motorcycle", ("a\udcff.csv",))]
    assert by_pattern("*.csv")[0].kind == "car"


def test_paths_are_relative_to_the_manifest():
    joined = [files.join("/data/", path) for path in ("a.csv", "/b.csv", "s3://c/d.csv")]
    assert joined == ["/data/a.csv", "/b.csv", "s3://c/d.csv"]
    assert files.join("", "a.csv") == "a.csv" and files.join("s3://x", "a.csv") == "s3://x/a.csv"
    assert files.is_remote("memory://a") and not files.is_remote("/a/b:c")
    assert files.folder_value("a/b=ä") == "a%2Fb%3D%C3%A4"


def test_a_changed_file_has_another_mark(tmp_path):
    path, other = tmp_path / "a.csv", tmp_path / "none.csv"
    path.write_text("one")
    os.utime(path, ns=(5, 5))
    marks = files.identities([str(path), str(other)])
    assert marks == {str(path): "3-5", str(other): ""}
    os.utime(path, ns=(6, 6))
    assert files.identities([str(path)]) != {str(path): marks[str(path)]}
