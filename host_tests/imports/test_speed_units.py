"""Tests the unit of the speed in the export of each app. The unit is the unit in the file, or an assumed unit."""

import numpy as np
import pytest
from kickstand_tools import api
from kickstand_tools.common.errors import InputError
from support.recordings import app_exports

# The value of each unit in m/s. A mile is 1609.344 m, and a nautical mile 1852 m.
IN_MPS = {"m/s": 1.0, "km/h": 1000 / 3600, "mph": 1609.344 / 3600, "knots": 1852 / 3600}

PHYPHOX, AIM, VBO, RACEBOX = "Velocity (m/s)", '"s","km/h"', "velocity kmh", "Speed,"


def exported(ride, app, said):
    """Return the files of an export whose speed has another label. Its numbers are unchanged."""
    if app == "phyphox":
        files = app_exports.phyphox(ride)
        return files | {"Location.csv": files["Location.csv"].replace(PHYPHOX, said)}
    if app == "AiM, row of units":
        return {"a.csv": app_exports.aim(ride).replace(AIM, f'"s","{said}"')}
    if app == "AiM, title":
        return {"a.csv": app_exports.aim(ride).replace(AIM, '"s",""').replace('"GPS Speed"', f'"GPS Speed{said}"')}
    if app == "VBO":
        return {"v.vbo": app_exports.vbo(ride).replace(VBO, said)}
    return {"r.csv": app_exports.racebox(ride, per_mps=3.6).replace("Speed,", f"{said},", 1)}


@pytest.mark.parametrize(
    ("app", "said", "per_mps", "unit"),
    [
        *[("phyphox", f"Velocity ({unit})", 1.0, unit) for unit in IN_MPS],
        ("phyphox", "Velocity", 1.0, "m/s"),
        *[("AiM, row of units", unit, 3.6, unit) for unit in IN_MPS],
        ("AiM, row of units", "", 3.6, "km/h"),
        *[("AiM, title", f" ({unit})", 3.6, unit) for unit in IN_MPS],
        *[("VBO", f"velocity {unit}", 3.6, unit) for unit in IN_MPS],
        ("VBO", "velocity", 3.6, "km/h"),
        ("VBO", "velocity furlongs", 3.6, "km/h"),
        *[("RaceBox", f"Speed ({unit})", 3.6, unit) for unit in IN_MPS],
        ("RaceBox", "KPH", 3.6, "km/h"),
        ("RaceBox", "Speed", 3.6, "km/h"),  # if the name has no unit, the positions decide
        ("RaceBox", "Speed (furlongs)", 3.6, "km/h"),
    ],
)
def test_the_speed_has_the_unit_that_the_file_says(tmp_path, app, said, per_mps, unit):
    ride = app_exports.riding().every(8)
    found = api.import_recording(app_exports.into(tmp_path / "export", exported(ride, app, said)))
    there = np.isfinite(found.log.speed_mps)
    t_s = (found.log.t_s + found.log.start_s)[there]
    want = np.interp(t_s, ride.t_s, ride.speed_mps) * per_mps * IN_MPS[unit]
    assert np.count_nonzero(there) > 20
    assert found.log.speed_mps[there] == pytest.approx(want, abs=0.1 * per_mps)
    assert [taken.unit for taken in found.taken if taken.quantity == "speed"] == [unit]


def test_an_unknown_unit_of_aim_is_refused(tmp_path):
    ride = app_exports.riding().every(8)
    with pytest.raises(InputError, match=r"is not known: 'furlongs'"):
        api.import_recording(app_exports.into(tmp_path / "export", exported(ride, "AiM, row of units", "furlongs")))


def test_a_unit_for_racebox_is_used_and_another_word_refused(tmp_path):
    files = app_exports.into(tmp_path / "export", {"r.csv": app_exports.racebox(app_exports.riding().every(8), 1.0)})
    given = api.import_recording(files, units={"speed": "knots"})
    own = api.import_recording(files)
    there = np.isfinite(own.log.speed_mps)
    assert given.log.speed_mps[there] == pytest.approx(own.log.speed_mps[there] * IN_MPS["knots"], abs=1e-3)
    with pytest.raises(InputError, match="furlongs"):
        api.import_recording(files, units={"speed": "furlongs"})
