"""For implausible readings the lean is not trusted, and a warning gives their place and values. numpy prints no
warning."""

import re
import warnings

import numpy as np
import pytest
from kickstand_tools.analysis.channels import joined
from kickstand_tools.analysis.ride import open_ride
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.common.messages import sentence
from kickstand_tools.logs.log import Log


def spinning(seed):
    """Return a log with impossible readings: the force stays upright, but the rates are random, up to 2500 deg/s."""
    rates = np.random.default_rng(seed).uniform(-2500, 2500, (600, 3))
    return Log(np.arange(600) / 100.0, np.tile([0.0, 1.0, 0.0], (600, 1)), rates, name="spin.csv")


def test_impossible_readings_give_a_warning_and_no_lean():
    """Impossible readings make the filter diverge in some of the six rides, but not in all."""
    diverged_in = 0
    for seed in range(6):
        notices = []
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ride = joined(list(open_ride(spinning(seed), CalibrationFile(aligned=True)).blocks(notices=notices)))
        lost = np.isnan(ride.lean_sigma_deg)
        assert not np.any(ride.trusted[lost] | (ride.sure[lost] > 0.0))
        said = [sentence(notice) for notice in notices if notice.code == "absurd-readings"]
        assert len(said) == np.any(lost)
        if said:
            diverged_in += 1
            found = re.match(r"implausible readings at (\S+) s, up to 2\d\d\d deg/s and 1.0 g", said[0])
            assert found and float(found[1]) == pytest.approx(ride.t_s[np.argmax(lost)], abs=0.06)
    assert diverged_in
