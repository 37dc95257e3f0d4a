"""The unit of rates is found from a fit, and the unit of speeds from positions. The expected numbers were computed by
hand."""

import numpy as np
import pytest
from kickstand_tools.imports.rate_fit import RateFit
from kickstand_tools.imports.recording import Sheet
from kickstand_tools.imports.speeds import unit_by_positions

RAD_S, DEG_S = 180.0 / np.pi, 1.0  # the value of each unit in deg/s


@pytest.mark.parametrize(
    ("times", "units", "explained", "unit"),
    [
        (1.0, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, "rad/s"),
        (1.0 / RAD_S, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, "deg/s"),
        # the fitted size may differ from a unit by a factor of up to e^1.2 = 3.32
        (3.3, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, "rad/s"),
        (1 / 3.3, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, "rad/s"),
        (3.35, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, ""),
        (1 / 3.35, {"rad/s": RAD_S, "deg/s": DEG_S}, 0.6, ""),
        # if two units differ by a factor below e^3 = 20.1, the fit must explain 0.9 of the variance
        (1.0, {"one": RAD_S, "other": RAD_S / 20.0}, 0.89, ""),
        (1.0, {"one": RAD_S, "other": RAD_S / 20.0}, 0.91, "one"),
        (1.0, {"one": RAD_S, "other": RAD_S / 20.2}, 0.51, "one"),
        (1.0, {"one": RAD_S, "other": RAD_S / 20.2}, 0.49, ""),
        # the limit between two units that differ by a factor of 2 is 1.414
        (1.4, {"one": RAD_S, "other": 2.0 * RAD_S}, 0.95, "one"),
        (1.43, {"one": RAD_S, "other": 2.0 * RAD_S}, 0.95, "other"),
        # with only one possible unit, the fitted size may differ by a factor of up to e^1 = 2.72
        (2.7, {"one": RAD_S}, 0.95, "one"),
        (2.75, {"one": RAD_S}, 0.95, ""),
        (1.0, {"one": RAD_S}, 0.89, ""),
    ],
)
def test_the_unit_of_rates_is_the_one_near_the_fit(times, units, explained, unit):
    assert RateFit(times, explained, turn=0.1).unit_among(units) == unit


@pytest.mark.parametrize(
    "fit", [RateFit(1.0, 0.95, turn=0.029), RateFit(1.0, 0.49, turn=0.1), RateFit(-1.0, 0.95, turn=0.1)]
)
def test_a_fit_of_too_little_decides_nothing(fit):
    assert not fit.decides
    assert fit.unit_among({"rad/s": RAD_S}) == ""
    assert RateFit(1.0, 0.5, turn=0.03).decides


def driving(mps, rows=40, period_s=0.5, east=True, per_degree=(1.0, 1.0)):
    """Simulate a straight course that begins at the equator, where one degree is 111 194.9 m.

    Returns:
        times: in ns.
        columns: latitudes and longitudes. One unit of column k is per_degree[k] degrees.
    """
    t_s = period_s * np.arange(rows)
    way = mps * t_s / 111_194.9
    lat, lon = (0.0 * way, way) if east else (way, 0.0 * way)
    return (t_s * 1e9).astype(np.int64), [lat / per_degree[0], lon / per_degree[1]]


def found_unit(said, mps, per_degree=(1.0, 1.0), places: tuple[int | None, int | None] = (1, 2), **way):
    time_ns, columns = driving(mps, per_degree=per_degree, **way)
    sheet = Sheet("a.csv", ["speed", "lat", "lon"], [np.full(len(time_ns), said), *columns])
    return unit_by_positions(sheet, time_ns, 0, places[0], places[1], per_degree)


@pytest.mark.parametrize("east", [True, False])
@pytest.mark.parametrize("per_degree", [(1.0, 1.0), (1 / 60, -1 / 60), (1e-7, 1e-7)])
@pytest.mark.parametrize(("said", "unit"), [(20.0, "m/s"), (72.0, "km/h"), (44.74, "mph"), (38.88, "knots")])
def test_positions_show_the_unit_of_the_speed(said, unit, per_degree, east):
    assert found_unit(said, 20.0, per_degree, east=east) == unit


@pytest.mark.parametrize(
    ("said", "mps", "more", "unit"),
    [
        (20.0, 20.0, {"places": (None, 2)}, ""),
        (20.0, 20.0, {"places": (1, None)}, ""),
        (3.1, 3.1, {}, "m/s"),
        (2.9, 2.9, {}, ""),  # below 3 m/s the errors of positions are too large
        (20.0, 20.0, {"rows": 21}, ""),  # 21 rows give 19 steps of one second, but the check needs 20
        (20.0, 20.0, {"rows": 22}, "m/s"),
        (24.9, 20.0, {}, "m/s"),  # the two speeds differ by a factor below 1.25
        (29.0, 20.0, {}, ""),
        (0.0, 20.0, {}, ""),
        (20.0, 20.0, {"period_s": 1.9}, "m/s"),
        (20.0, 20.0, {"period_s": 2.1}, ""),
    ],
)
def test_a_speed_that_the_positions_do_not_show_has_no_unit(said, mps, more, unit):
    assert found_unit(said, mps, **more) == unit
