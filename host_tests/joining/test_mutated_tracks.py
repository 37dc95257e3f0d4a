"""Tracks and calibrations are damaged in many ways. Each file is read, or refused in one line."""

import json
import random

import numpy as np
import pytest
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.common.errors import InputError
from kickstand_tools.joining.track import Track
from kickstand_tools.joining.track_files import read_track
from support import command
from support.recordings import broken_logs, phone_tracks

COUNT = 150


def some_track():
    at = np.arange(60.0)
    return Track(1.78e9 + at, 48.1 + 1e-4 * at, 11.5 + 1e-4 * at, np.full(60, 12.0), "t")


def flipped(content, number):
    """Return damaged content: changed bytes, a cut end, a missing piece, or zero bytes. number: selects the damage."""
    chance = random.Random(number)
    change = (broken_logs.flip_bytes, broken_logs.cut_end, broken_logs.cut_a_piece, broken_logs.put_nul_bytes)[
        number % 4
    ]
    return change(content, chance)


def outcome(read, path):
    try:
        read(path)
    except InputError as error:
        assert "\n" not in str(error)
        assert len(str(error)) < 400
        return "refused"
    return "read"


@pytest.mark.parametrize("kind", ["gpx", "fit"])
def test_a_mutated_track_is_read_or_refused(tmp_path, kind):
    path = tmp_path / f"t.{kind}"
    (phone_tracks.write_gpx if kind == "gpx" else phone_tracks.write_fit)(path, some_track())
    content = path.read_bytes()
    seen = set()
    for number in range(COUNT):
        broken = broken_logs.broken([content], number)[1] if kind == "gpx" else flipped(content, number)
        path.write_bytes(broken)
        seen.add(outcome(read_track, path))
    assert seen == {"read", "refused"}


def test_a_mutated_calibration_is_read_or_refused(tmp_path):
    content = command.write_cal(tmp_path / "CAL.json").read_bytes()
    values = (None, True, "x", -1, 1e308, [], {}, [[]], [None] * 3, ["1"] * 3, [1e400] * 3, [10**400] * 3)
    wrong = [json.dumps(json.loads(content) | {key: value}) for key in json.loads(content) for value in values]
    seen = set()
    for broken in [broken_logs.broken([content], k)[1] for k in range(COUNT)] + [one.encode() for one in wrong]:
        (tmp_path / "CAL.json").write_bytes(broken)
        seen.add(outcome(read_calibration, tmp_path / "CAL.json"))
    assert seen == {"read", "refused"}
