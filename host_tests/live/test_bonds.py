"""The keys of paired phones stay in flash until the PIN changes."""

import json

import pytest
from kickstand.live.radio import BONDS, Bonds


@pytest.fixture(autouse=True)
def flash(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path / BONDS


def test_key_is_found_by_kind_and_name_or_by_index():
    bonds = Bonds("123456")
    assert bonds.get(1, 0, b"a") is None and bonds.get(1, 0, None) is None
    for kind, name, value in ((1, b"a", b"old"), (2, b"a", b"other kind"), (1, b"b", b"two"), (1, b"a", b"one")):
        assert bonds.put(kind, memoryview(name), memoryview(value))
    assert [bonds.get(1, 0, name) for name in (b"a", b"b", b"c")] == [b"one", b"two", None]
    assert [bonds.get(1, index, None) for index in (0, 1, 2)] == [b"one", b"two", None]
    assert bonds.get(2, 0, b"a") == b"other kind" and bonds.get(2, 1, None) is None
    assert [bonds.put(1, b"a", None), bonds.put(1, b"a", None)] == [True, False]  # None deletes the key
    assert bonds.get(1, 0, b"a") is None


def test_saved_keys_are_read_back_with_the_same_pin_only(flash):
    bonds = Bonds("123456")
    bonds.save()
    assert not flash.exists()
    bonds.put(1, b"a", b"\x00\xff")
    bonds.save()
    assert json.loads(flash.read_text()) == {"pin": "123456", "keys": [[1, "61", "00ff"]]}
    assert Bonds("123456").get(1, 0, b"a") == b"\x00\xff"
    assert Bonds("654321").get(1, 0, b"a") is None
    flash.unlink()
    bonds.save()  # nothing has changed since the last save
    assert not flash.exists()


@pytest.mark.parametrize("text", ["", "{", "[]", '{"pin": "123456"}', '{"pin": "123456", "keys": [[1, "x", "y"]]}'])
def test_a_damaged_file_means_no_keys(flash, text):
    flash.write_text(text)
    assert Bonds("123456").get(1, 0, None) is None
