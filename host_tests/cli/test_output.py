"""A file is written completely or not at all."""

import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.common.output import whole_file


@pytest.mark.parametrize("error", [InputError("is the line cut?"), OSError(28, "no room"), KeyboardInterrupt()])
def test_failed_write_leaves_only_the_earlier_file(tmp_path, error):
    path = tmp_path / "ride.vbo"
    path.write_text("old")
    with pytest.raises((InputError, KeyboardInterrupt)), whole_file(path) as temporary:
        temporary.write_text("half of the n")
        raise error
    assert [one.read_text() for one in tmp_path.iterdir()] == ["old"]
    with whole_file(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert [one.read_text() for one in tmp_path.iterdir()] == ["new"]
