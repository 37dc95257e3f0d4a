"""Runs the soak for a few minutes, and proves that each of its checks can fail."""

import gc
from importlib import import_module

import pytest
from kickstand_sim.simulation.scripted import script
from kickstand_workshop import soak as soaking
from kickstand_workshop.soak import soak
from kickstand_workshop.trip import SENSOR, SHORT_S, Trip

# A power cut leaves a ride's file open. On a board its reset closes the file.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(autouse=True)
def _close_files():
    yield
    gc.collect()


@pytest.mark.parametrize("hours", [0.01, pytest.param(0.1, marks=pytest.mark.long)])
def test_some_minutes_of_random_rides_and_faults(hours):
    figures = soak(hours=hours, seed=4)
    assert figures.violations == [] and figures.hours >= hours and sum(figures.faults.values()) > 0
    assert f"| trips | {figures.trips}," in figures.table()


def trip(cut_save=None):
    """Run both poses, then a lean of 12 degrees to the right for a while, with one failed transfer."""
    ride = script.Ride([script.kickstand(8.0), script.upright(8.0), script.upright(12.0, 12.0)])
    presses = [(3.0, SHORT_S), (13.0, SHORT_S)]
    return Trip("poses", ride, ride.seconds, presses, [], [("nack_for", (SENSOR, 20.0, 0.01))], cut_save=cut_save)


@pytest.mark.parametrize(
    ("broken", "cut_save", "message"),
    [
        (None, 30, None),
        (("kickstand.ui.pages", "side_name", lambda lean_deg: "left" if lean_deg > 0 else "right"), None,
         "a wrong lean is shown as good"),
        (("kickstand.calibration.store", "FILES", ("only.cal", "only.cal")), 30, "the six positions are lost"),
        (("kickstand.imu.mpu6050", "decode", lambda *_: 1 / 0), None, "ended with 'reset'"),
    ],
)  # fmt: skip
def test_every_check_of_the_soak_can_fail(broken, cut_save, message, monkeypatch):
    """The firmware is broken at one place."""
    if broken:
        with soaking.Board(lambda t_s: 6 * (0.0,)):  # the module may need the board's `time`
            import_module(broken[0])
        monkeypatch.setattr(".".join(broken[:2]), broken[2])
    monkeypatch.setattr(soaking, "make_trip", lambda *_: trip(cut_save))
    figures = soak(hours=0.001)
    matching = [line for line in figures.violations if (message or "") in line]
    assert (figures.trips, bool(matching)) == (1, bool(message)), figures.violations
