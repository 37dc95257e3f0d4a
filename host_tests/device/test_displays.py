"""Tests the whole device with each display. All displays show the same lean, and recover from every fault."""

import random

import pytest
from support import device_plans

SHOTS = 200


@pytest.mark.parametrize(
    ("engine", "display", "one_bus"), [("micropython", "ssd1306", False), ("cpython", "sh1106", True)]
)
def test_the_lean_is_that_of_the_character_display(engine, display, one_bus, tmp_path, capsys):
    plan = device_plans.ALIGNED | {"board": {"display": display, "one_bus": one_bus}}
    plan["config"] = {"LCD_SDA": 4, "LCD_SCL": 5} if one_bus else {}
    seen = device_plans.run(engine, tmp_path, plan, capsys)
    assert not seen.too_fast and seen.ends == ["off"]
    assert seen.first("Aligned!") < 17
    for t_s, lean_deg in ((device_plans.LEFT_S, -30), (device_plans.RIGHT_S, 40)):
        leans = seen.leans(t_s - 0.5, t_s)
        assert leans and all(abs(lean - lean_deg) < 4 for lean in leans)


@pytest.mark.parametrize(("engine", "display"), [("cpython", "lcd"), ("micropython", "ssd1306")])
def test_presses_and_unplugs_at_random(engine, display, tmp_path):
    """At the end the display shows a page as usual. host_tests/simulated_board tests the heap with each display."""
    chance = random.Random(3)
    presses, faults = [[2, 0.15], [12, 0.15]], []
    for k in range(SHOTS):
        at_s = 18.0 + 0.2 * k
        if chance.random() < 0.6:
            presses.append([at_s, chance.choice((0.1, 0.15, 0.9))])
        else:
            faults.append(["unplug_lcd", [at_s, chance.choice((0.001, 0.05, 0.25))]])
    until_s = 18.0 + 0.2 * SHOTS + 45.0  # every menu and wizard has ended by this time
    plan = {
        "ride": device_plans.RIDE,
        "presses": presses,
        "until": until_s,
        "board": {"display": display},
        "faults": faults,
    }
    seen = device_plans.run(engine, tmp_path, plan)
    assert seen.ends == ["off"]
    assert seen.last[0].strip() not in ("", "?")
