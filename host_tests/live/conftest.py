"""A board that sends its lean to a phone, and the rides for it."""

import pytest
from support import device_plans

# A bike that was aligned before: a bend to the left until 14 s, a bend to the right until 22 s, then straight ahead
RIDE = [["upright", 2.0], ["accelerate", 15.0, 4.0], ["turn", -30.0, 5.0], ["turn", 40.0, 5.0], ["straight", 60.0]]


@pytest.fixture
def on_the_road():
    """Return the plan of a ride, and the times near the end of the left bend, of the right bend, and later."""
    return {"ride": RIDE, "until": 27}, (12.0, 20.0, 26.0)


@pytest.fixture
def run(tmp_path, capsys):
    """Return run(plan, phone's acts..., engine, **config), which runs an aligned board with LIVE."""
    device_plans.align(tmp_path)

    def run(plan, *phones, engine="cpython", **config):
        config = {"LIVE": True, "SAMPLE_HZ": 100, **config}
        plan = {"board": {"machine": "pico w"}, **plan, "phones": list(phones), "config": config}
        return device_plans.run(engine, tmp_path, plan, capsys)

    return run
