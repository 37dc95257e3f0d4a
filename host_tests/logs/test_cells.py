"""Tests the largest values that a log may have. Both readers of logs refuse slightly larger values and name the
unit."""

import contextlib
import io

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.logs import cells as log_cells
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import read_blocks, read_log
from support import command

HEADER = command.HEADER + ",speed_mps,temp_c,lat_deg,lon_deg,utc_s"
# The widest ranges of the chips are 16 g and 2000 deg/s, so larger values are in another unit. The data sheets of the
# chips allow up to 85 C. Each entry is {column: (largest value, unit)}.
LIMITS = {
    "t_s": (1e10, "seconds"),
    "ax_g": (20.0, "g"),
    "ay_g": (20.0, "g"),
    "az_g": (20.0, "g"),
    "gx_dps": (2500.0, "deg/s"),
    "gy_dps": (2500.0, "deg/s"),
    "gz_dps": (2500.0, "deg/s"),
    "speed_mps": (200.0, "m/s"),
    "temp_c": (200.0, "degrees Celsius"),
    "lat_deg": (90.0, "degrees"),
    "lon_deg": (180.0, "degrees"),
    "utc_s": (1e10, "seconds since 1970"),
}


@pytest.mark.parametrize("quoted", [False, True])  # one reader reads whole columns, the other reads single cells
@pytest.mark.parametrize("name", LIMITS)
def test_values_out_of_range_are_refused(name, quoted):
    limit, unit = LIMITS[name]
    for sign in (1.0, -1.0) if name != "t_s" else (1.0,):
        for factor, good in (1.0, True), (1.001, False):
            rows = []
            for time in range(5):  # the last value is extreme
                cells = dict.fromkeys(HEADER.split(","), "0") | {"t_s": f"{time}", "az_g": "1"}
                cells |= {name: f"{sign * factor * limit:.10g}"} if time == 4 else {}
                rows.append(",".join(cells.values()))
            rows[0] = rows[0].replace("0", '"0"', quoted)
            log = io.StringIO("\n".join([HEADER, *rows]) + "\n")
            if name == "t_s":  # a time step of this size means that the unit is ms, which another check refuses
                words = "milliseconds" if good else "line 6: t_s is '.*', past any reading: its unit is seconds"
                with pytest.raises(InputError, match=words):
                    read_log(log)
            elif good:
                assert len(read_log(log).t_s) == 5
            else:
                with pytest.raises(InputError, match=f"line 6: {name} is '.*', past any reading: its unit is {unit}$"):
                    read_log(log)


def test_a_firmware_without_a_temperature_gets_25():
    n = 3
    log = Log(np.arange(n) / 100.0, np.tile([0.1, 0.2, 0.9], (n, 1)), np.tile([1.0, 2.0, 3.0], (n, 1)))
    log.temperature_c[1] = 31.5
    temperatures = [row[1][3] for row in log.rows()]
    assert temperatures == [25.0, 31.5, 25.0]
    assert [row for block in read_blocks(log) for row in block.rows()][1][:2] == (
        10_000,
        [0.1, 0.2, 0.9, 31.5, 1.0, 2.0, 3.0],
    )


@pytest.mark.parametrize(
    ("size_g", "step_s", "words"),
    [(9.81, 0.01, "look like m/s2"), (1.0, 10.0, "is t_s in milliseconds"), (4.5, 0.01, ""), (1.0, 2.0, "")],
)
def test_common_wrong_units_are_refused(size_g, step_s, words):
    """The check uses the usual size of the force, not single axes."""
    force = np.tile([size_g * 0.6, 0.0, size_g * 0.8], (9, 1))
    force[:4] = [0.0, 1.0, 0.0]
    log = Log(np.arange(9) * step_s, force, np.zeros((9, 3)))
    with pytest.raises(InputError, match=words) if words else contextlib.nullcontext():
        read_log(log)


@pytest.mark.parametrize(
    ("log", "line", "words"),
    [
        ("A.gpx", "<?xml version", "A.gpx is a track: kickstand join adds it to a ride"),
        ("A.FIT", "x", "A.FIT is a track"),
        ("A.cal.json", "{", "A.cal.json is not a log: give the ride, and a calibration with --calibration"),
        ("A.csv", "t_s,lean_deg", "A.csv contains a lean but no readings: give the log that it was made from"),
        ("A.csv", "t_s;ax_g;ay_g", "A.csv, line 1: values are separated by ; or tab"),
        ("A.csv", "t_s\tax_g", "A.csv, line 1: values are separated by ; or tab"),
        ("A.csv", command.HEADER + ",ax_g", "A.csv, line 1"),
        ("A.csv", command.HEADER.replace("ay_g,", ""), "ay_g"),
    ],
)
def test_a_file_that_is_no_log_is_named(log, line, words):
    with pytest.raises(InputError) as caught:
        log_cells.header(log, line)
    assert words in str(caught.value)


def test_a_header_may_have_spaces_and_any_order():
    names = command.HEADER.split(",")[::-1]
    assert log_cells.header("A.csv", " , ".join(names)) == names


def test_a_directory_is_no_log(tmp_path):
    with pytest.raises(InputError, match="is a directory: give the name of a log in it"):
        read_log(tmp_path)
