"""Runs the soak for a few minutes, and proves that each of its checks can fail."""

import pytest
from kickstand_tools.simulation.scripted import script
from kickstand_workshop.soak import soak as soaking
from kickstand_workshop.soak.__main__ import table
from kickstand_workshop.soak.soak import soak
from kickstand_workshop.soak.trip import SENSOR, SHORT_S, Trip


def test_some_minutes_of_random_rides_and_faults():
    figures = soak(hours=0.04, seed=4)
    assert figures.found == []
    assert figures.hours >= 0.04
    assert sum(figures.faults.values()) > 0
    assert f"| trips | {figures.trips}," in table(figures)


def reversed_lean(monkeypatch):
    from kickstand.ui import pages

    monkeypatch.setattr(pages, "side_name", lambda lean_deg: "left" if lean_deg > 0 else "right")


def one_record(monkeypatch):
    from kickstand.calibration import store

    monkeypatch.setattr(store, "FILES", ("only.cal", "only.cal"))


def raises(monkeypatch):
    from kickstand.imu.sensor import Sensor

    monkeypatch.setattr(Sensor, "_missed", lambda self, now_ms: 1 / 0)


def trip(seconds, cut_save=None):
    """Run both poses, then a lean of 12 degrees to the right for a while, with one failed transfer."""
    ride = script.Ride([script.kickstand(8.0), script.upright(8.0), script.upright(seconds, 12.0)])
    presses = [(3.0, SHORT_S), (13.0, SHORT_S)]
    return Trip("poses", ride, ride.seconds, presses, [], [("nack_for", (SENSOR, 20.0, 0.01))], cut_save=cut_save)


@pytest.mark.parametrize(
    ("broken", "made", "said"),
    [
        (lambda monkeypatch: None, trip(12.0, 30), None),
        (reversed_lean, trip(12.0), "a wrong lean is shown as good"),
        (one_record, trip(12.0, 30), "the six positions are lost"),
        (raises, trip(12.0), "ended with 'reset'"),
    ],
)
def test_every_check_of_the_soak_can_fail(broken, made, said, monkeypatch):
    broken(monkeypatch)
    monkeypatch.setattr(soaking, "make_trip", lambda *_: made)
    figures = soak(hours=0.001)
    assert figures.trips == 1
    assert any(said in line for line in figures.found) if said else not figures.found, figures.found
