"""The values of a ride that the gauge shows."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.analysis.summary import HELD_S
from kickstand_tools.joining.motion import STEP_S, CellMotion
from kickstand_tools.overlay.camera_match import camera_offset_s
from kickstand_tools.overlay.gpmf import Telemetry
from kickstand_tools.overlay.shown import _maximum, shown
from support.recordings import analysis_rides


@pytest.fixture(scope="module")
def ride(tmp_path_factory):
    return analysis_rides.short(tmp_path_factory.mktemp("ride"), rate_hz=100, speed_hz=1)


def test_shown_values_are_those_of_the_display(ride):
    seen, lean = shown(api.open_ride(ride)), api.vehicle_channels(ride)
    sure = lean.trusted
    assert np.array_equal(seen.t_s, lean.t_s)
    assert np.array_equal(seen.lean_deg[sure], lean.lean_deg[sure])
    assert np.all(np.isnan(seen.lean_deg[~sure]))
    assert seen.right_deg[-1] == pytest.approx(np.nanmax(seen.lean_deg), abs=0.5)
    assert seen.left_deg[-1] == pytest.approx(-np.nanmin(seen.lean_deg), abs=0.5)
    assert seen.has_speed
    braking = seen.at(np.array([seen.t_s[-1] - 6.0]))
    assert braking.forward_g[0] < -0.2
    turning = np.abs(seen.lean_deg) > 25.0
    # In a right turn the force is to the right
    assert np.all(np.sign(seen.left_g[turning]) == -np.sign(seen.lean_deg[turning]))


def test_brief_or_untrusted_lean_is_no_maximum(ride, monkeypatch):
    opened = api.open_ride(ride)
    blocks = list(opened.blocks())

    def changed():
        for block in blocks:
            at = np.searchsorted(block.t_s, 2.0)
            block.lean_deg[at : at + 10] = 64.0  # 0.1 s
            block.lean_deg[at + 100 : at + 150] = -64.0
            block.sure[at + 100 : at + 150] = 0.0
            yield block

    monkeypatch.setattr(type(opened), "blocks", lambda self, progress=None, notices=None, mount=None: changed())
    seen = shown(opened)
    early = seen.t_s < 4.0
    assert seen.right_deg[early].max() < 5.0
    assert seen.left_deg[early].max() < 5.0
    assert np.isnan(seen.at(np.array([3.2])).lean_deg[0])


def test_contradicted_calibration_is_reported_by_overlay(ride):
    """Like every command with a calibration, `overlay` reports a contradicted calibration."""
    calibration = api.read_calibration(ride.with_name("RIDE.cal.json"))
    backward = replace(calibration, vehicle_from_sensor=np.diag([-1.0, 1.0, -1.0]))
    for given, codes in ((calibration, []), (backward, ["forward-exchanged"])):
        notices: list[api.Message] = []
        shown(api.open_ride(ride, given), notices=notices)
        assert [notice.code for notice in notices] == codes


def test_a_maximum_must_last_and_unknown_leans_count_as_none():
    """At 100 samples per second and HELD_S = 0.15 s, a maximum needs sixteen samples in a row. The first lean has only
    fifteen."""
    t_s = np.arange(60) / 100.0
    lean = np.full(60, np.nan)
    assert _maximum(t_s, lean).tolist() == [0.0] * 60
    assert HELD_S == 0.15
    lean[5:20], lean[30:46] = 30.0, 20.0  # the first lean lasts 15 samples, the second 16
    lean[50:] = -5.0
    found = _maximum(t_s, lean)
    assert found.tolist() == [0.0] * 45 + [20.0] * 15


def test_a_camera_with_uneven_times_is_found_in_the_ride():
    """Each cell of 50 ms contains one to four of the camera's readings. The ride began 12 s before the video."""
    chance = np.random.default_rng(4)
    knots_s = np.arange(0.0, 62.0, 0.7)
    knots = chance.normal(scale=30.0, size=(len(knots_s), 3))

    def rates(t_s):
        return np.column_stack([np.interp(t_s, knots_s, axis) for axis in knots.T])

    cells_s = STEP_S * (np.arange(1200) + 0.5)
    still = np.zeros((1200, 3))
    ride = CellMotion(still, rates(cells_s), np.ones(1200, dtype=bool), False, False)
    t_s = np.cumsum(chance.choice([0.0125, 0.025, 0.05], size=1200))
    camera = Telemetry(t_s, rates(t_s + 12.0)[:, [2, 0, 1]] + [1.0, -2.0, 0.5])
    offset_s, correlation = camera_offset_s(ride, camera)
    assert offset_s == pytest.approx(12.0, abs=0.03)
    assert correlation > 0.95
