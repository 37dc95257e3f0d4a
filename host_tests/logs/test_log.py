"""A log in memory: shapes and times that are refused, the order of columns, blocks, stretches, names."""

import io
from typing import Any

import numpy as np
import pytest
from kickstand_tools.api import Log, Stretch
from kickstand_tools.common.messages import InputError
from kickstand_tools.logs import reader
from kickstand_tools.logs.reader import read_log
from support import command

FORCE, RATE = [0.1, 0.2, 0.9], [1.0, 2.0, 3.0]


def log_of(n: int, start_s: float = 0.0, **more: Any) -> Log:
    return Log(start_s + np.arange(n) / 100.0, np.tile(FORCE, (n, 1)), np.tile(RATE, (n, 1)), **more)


def test_times_count_from_the_first_sample():
    log = log_of(3, 1_700_000_000.25)
    assert (log.start_s, log.time_us.tolist()) == (1_700_000_000.25, [0, 10_000, 20_000])
    later = Log(np.array([2.0, 3.0]), log.accel_g[:2], log.gyro_dps[:2], start_s=10.0)
    assert (later.start_s, later.t_s.tolist()) == (12.0, [0.0, 1.0])
    assert (log_of(2, utc_s=[np.nan, 1000.5]).start_utc_s, log.start_utc_s) == (pytest.approx(1000.49), None)


def test_the_chips_order_and_the_names_of_the_columns():
    track: Any = {"lat_deg": [52.1, np.nan], "lon_deg": [-0.5, np.nan], "utc_s": [1.7e9, np.nan]}
    log = log_of(2, temperature_c=[20.0, 21.0], speed_mps=[5.0, np.nan], **track)
    assert log.readings[1].tolist() == [0.1, 0.2, 0.9, 21.0, 1.0, 2.0, 3.0]
    names = [*command.HEADER.split(","), "speed_mps", "lat_deg", "lon_deg", "utc_s", "temp_c"]
    first = {name: values[0] for name, values in log.columns().items()}
    assert first == dict(zip(names, [0.0, *FORCE, *RATE, 5.0, 52.1, -0.5, 1.7e9, 20.0], strict=True))
    copy = Log.from_readings(log.readings, 50.0, "mine")
    assert (copy.t_s.tolist(), copy.name) == ([0.0, 0.02], "mine")
    assert copy.readings.tolist() == log.readings.tolist() and np.isnan(copy.speed_mps).all()


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"t_s": [[0.0], [1.0]]}, r"t_s has the shape \(2, 1\), it must be \(2,\)"),
        ({"accel_g": [[0.0, 1.0]] * 2}, r"accel_g has the shape \(2, 2\), it must be \(2, 3\)"),
        ({"gyro_dps": [RATE]}, r"gyro_dps has the shape \(1, 3\), it must be \(2, 3\)"),
        ({"lat_deg": [1.0]}, r"lat_deg has the shape \(1,\), it must be \(2,\)"),
        ({"t_s": [0.0, 0.0]}, "must increase"),
        ({"t_s": [1.0, 0.5]}, "must increase"),
        ({"t_s": [0.0, 4e-7]}, "must increase"),  # both times round to the same microsecond
    ],
)
def test_arrays_that_do_not_fit_are_refused(arrays, words):
    with pytest.raises(InputError, match="the log: .*" + words):
        Log(**({"t_s": [0.0, 1.0], "accel_g": [FORCE] * 2, "gyro_dps": [RATE] * 2} | arrays))


def test_a_log_comes_in_parts():
    log = log_of(10, 7.0, speed_mps=[5.0, *[np.nan] * 9])
    spans, parts = zip(*log.parts(np.arange(10) != 5, slice(1, 9), most=4))
    assert [(span.start, span.stop) for span in spans] == [(1, 5), (5, 9)]
    assert np.concatenate([part.time_us for part in parts]).tolist() == [10_000 * k for k in (1, 2, 3, 4, 6, 7, 8)]
    part = log.between(0.04, 0.07)
    assert (part.start_s, part.t_s.tolist()) == (pytest.approx(7.04), pytest.approx([0.0, 0.01, 0.02, 0.03]))


def test_parts_have_the_values_of_a_receiver_that_the_whole_log_has():
    lines = [f"{k},0,1,0,0,0,0,{'' if k % 5 else k}" for k in range(20)]
    log = read_log(io.StringIO("t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,speed_mps\n" + "\n".join(lines)))
    known = np.where(np.arange(20) % 5, np.nan, np.arange(20.0))
    parts = np.concatenate([part.speed_mps for _, part in log.parts(np.ones(20, dtype=bool), most=5)])
    assert np.array_equal([log.speed_mps, parts], [known, known], equal_nan=True)
    with pytest.raises(ValueError, match="read-only"):
        log.speed_mps[0] = 1.0  # would be lost


@pytest.mark.parametrize(
    ("from_s", "to_s", "words"),
    [
        (0.5, 0.5, "the stretch ends before it begins"),
        (None, -20.0, "the stretch ends before it begins"),
        (1.5, None, r"no samples in this stretch: the log is 1\.0 s long"),
        (0.2, 0.205, "too short: 1 samples, at least 2 are needed"),
    ],
)
def test_a_stretch_without_samples_is_refused(from_s, to_s, words):
    with pytest.raises(InputError, match=words):
        read_log(Stretch(log_of(101), from_s, to_s))


def test_a_log_has_a_largest_number_of_samples(monkeypatch):
    monkeypatch.setattr(reader, "MOST_SAMPLES", 100)
    assert len(read_log(log_of(100)).t_s) == 100
    with pytest.raises(InputError, match="million samples: kickstand cut writes a part of it"):
        read_log(log_of(101))
