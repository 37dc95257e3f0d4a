"""The values of a ride that the gauge shows."""

from dataclasses import replace

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.overlay.shown import shown
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
    assert np.all(np.sign(seen.left_g[turning]) == -np.sign(seen.lean_deg[turning]))  # right lean: pushed right


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
    """As in every command with a calibration."""
    calibration = api.read_calibration(ride.with_name("RIDE.cal.json"))
    backward = replace(calibration, vehicle_from_sensor=np.diag([-1.0, 1.0, -1.0]))
    for given, codes in ((calibration, []), (backward, ["forward-exchanged"])):
        notices: list[api.Message] = []
        shown(api.open_ride(ride, given), notices=notices)
        assert [notice.code for notice in notices] == codes
