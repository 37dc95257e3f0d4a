"""Nicolae's formula at its edges. Runs on MicroPython too."""

from math import asin, atan, cos, degrees, radians, sin

from bike_motion import felt, near
from kickstand.lean.formula import centripetal_g, formula_lean_deg, static_lean_deg


def test_the_lean_of_a_standing_bike_has_the_side_of_the_force():
    for lean in (-170.0, -80.0, -0.1, 0.0, 12.0, 89.0, 179.0):
        near(static_lean_deg([2.0 * sin(radians(lean)), 2.0 * cos(radians(lean)), 5.0]), lean, 1e-9)


def test_the_centripetal_force_has_its_size_from_the_force_and_its_side_from_the_yaw_rate():
    near(centripetal_g(0.6, 1.0, 1.0), 0.6, 1e-12)
    near(centripetal_g(-0.6, 1.0, -0.001), -0.6, 1e-12)
    assert centripetal_g(0.6, 1.0, 0.0) == 0.0
    assert centripetal_g(0.6, 0.8, 1.0) == 0.0
    assert centripetal_g(0.1, 0.8, 1.0) == 0.0  # less than 1 g: the root of less than nothing


def test_a_balanced_turn_and_one_that_is_not():
    for lean in (-40.0, -3.0, 5.0, 50.0):
        force, rate = felt(lean, 15.0)
        near(formula_lean_deg(force, rate[1]), lean, 1e-6)
    # a car in a flat left turn of 0.5 g: no lean
    near(formula_lean_deg([0.5, 1.0, 0.0], 0.3), 0.0, 1e-6)
    near(formula_lean_deg([0.5, 1.0, 0.0], -0.3), 2.0 * degrees(atan(0.5)), 1e-6)


def test_under_a_tenth_of_a_g_no_force_gives_a_direction():
    assert formula_lean_deg([0.0, 0.099, 9.0], 1.0) == 0.0
    assert formula_lean_deg([0.099, 0.0, 9.0], 1.0) == 0.0
    near(formula_lean_deg([0.08, 0.06, 0.0], 1.0), 90.0, 1e-6)  # its sine would be over 1
    near(formula_lean_deg([-0.08, 0.06, 0.0], 1.0), -90.0, 1e-6)
    near(formula_lean_deg([0.005, 0.1009, 0.0], 1.0), degrees(asin(0.005 / (0.005**2 + 0.1009**2))), 1e-6)
