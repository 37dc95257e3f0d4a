"""A flash erase, slow USB or a storm of wheel pulses stops the loop for a while, or a transfer to the display breaks
off in a line. The display never shows a lean that is more than half a second old, or half old and half new."""

import pytest
from kickstand_sim.simulation.scripted import script
from support import engines

FROM_S = 15.0
UNTIL_S = FROM_S + 8.0
# From FROM_S on the bike rolls quickly from side to side. So the value of a displayed lean shows how old it is.
RIDE = [
    ["upright", 2.0],
    ["accelerate", 15.0, 5.0],
    ["turn", -30.0, 2.0],
    ["turn", 40.0, 0.0],
    *[["turn", 40.0 * (-1) ** k, 0.3] for k in range(8)],
]
TRUE = script.Ride([getattr(script, name)(*more) for name, *more in RIDE])
# the sum of half a second, the time to write a page, and the time between two frames of the record
OLDEST_S = 0.5 + 0.1 + 0.1
HANG_S = 1.46  # a hang of this duration ends so that the next frame of the record has a complete page
NEAR_DEG = 10.0  # readings lost while the bike rolls cause errors of up to 8 degrees for a while

STARVED = {
    "flash erase": ([["busy", [FROM_S, 0.4, 6]]], {}),
    "slow USB": ([["busy", [FROM_S + 0.45, 0.48, 6]]], {}),
    "slow turns": ([["busy", [FROM_S, 0.12, 30]]], {}),
    "a hang": ([["busy", [FROM_S + 0.3, HANG_S]]], {}),
    "few samples a second": ([["busy", [FROM_S, 0.3, 12]]], {"SAMPLE_HZ": 50, "DLPF": 5}),
    "display breaks off": ([["cut", [0x27, FROM_S + 0.3 + k, 9 + 11 * k]] for k in range(5)], {}),
}


def riding(faults, config, **more):
    return {"ride": RIDE, "until": UNTIL_S, "faults": faults, "config": {"SAMPLE_HZ": 200, **config}, **more}


def too_old(record, from_s=FROM_S - 5.0):
    """Return the displayed leans that the bike has not had within the last OLDEST_S.

    Returns a list of (t_s, line, smallest lean, largest lean). The smallest and the largest lean are the bike's within
    the last OLDEST_S.
    """
    old = []
    for k in range(int(10 * (UNTIL_S - from_s))):
        t_s = from_s + k / 10
        displayed = record.lean_at(t_s)
        recent = [TRUE.truth(t_s - OLDEST_S * i / 20)[0] for i in range(21)]
        if displayed is not None and not min(recent) - NEAR_DEG <= displayed <= max(recent) + NEAR_DEG:
            old.append((t_s, record.at(t_s)[0], min(recent), max(recent)))
    return old


@pytest.mark.parametrize(("engine", "name"), [("cpython", n) for n in STARVED] + [("micropython", "a hang")])
@pytest.mark.usefixtures("aligned")
def test_no_lean_on_the_display_is_too_old(engine, name, run):
    record = run(riding(*STARVED[name]), engine)
    assert record.ends == ["off"]
    # While the program hangs, it cannot change the display.
    hang_s = (FROM_S + 0.3, FROM_S + 0.3 + HANG_S + 0.05) if name == "a hang" else (0, 0)
    assert [old for old in too_old(record) if not hang_s[0] < old[0] < hang_s[1]] == []
    if name == "a hang":
        assert record.first("Readings lost", FROM_S) < hang_s[1] + 0.1
    assert record.lean_at(FROM_S - 0.5) is not None
    assert len(record.leans(FROM_S + 7.0, UNTIL_S)) > 3


@pytest.mark.parametrize("engine", engines.ENGINES[1:])
@pytest.mark.usefixtures("aligned")
def test_storm_of_wheel_pulses_is_reported_and_leaves_the_lean(engine, run):
    """At 50,000 pulses per second the loop gets no time, until the interrupt's handler disables the interrupt."""
    record = run(riding([["wheel_storm", [FROM_S, 3.0, 50_000]]], {"SPEED": "wheel"}, wheel={}), engine)
    assert record.ends == ["off"]
    assert record.first("Wheel: noise") < FROM_S + 0.3
    assert too_old(record, FROM_S + 2.5) == []
    assert len(record.leans(FROM_S + 2.5, FROM_S + 4.0)) > 3
