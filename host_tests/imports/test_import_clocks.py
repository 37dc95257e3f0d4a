"""Joining of sensors on one clock, and the stretch that is imported."""

import numpy as np
import pytest
from kickstand_tools.common.errors import InputError
from kickstand_tools.imports import importing, join, recording
from kickstand_tools.imports.recording import AppRecording, ReceiverTrack, RecordedSensor
from kickstand_tools.logs.log import Log

MS = 1_000_000


def sensor(times_ms, values=None, name="accelerometer") -> RecordedSensor:
    time_ns = np.round(np.array(times_ms, dtype=float) * MS).astype(np.int64)
    rows = np.tile([0.0, 1.0, 0.0], (len(time_ns), 1)) if values is None else np.array(values, dtype=float)
    return RecordedSensor(name, time_ns, rows)


# recording.py


def track(time_s, speed, lat=None, lon=None) -> ReceiverTrack:
    nothing = np.full(len(time_s), np.nan)
    lat, lon = (nothing if place is None else np.array(place, dtype=float) for place in (lat, lon))
    return ReceiverTrack(np.round(np.array(time_s) * 1e9).astype(np.int64), np.array(speed, dtype=float), lat, lon)


# join.py


def test_a_single_wrong_time_is_damaged():
    def damaged(*times_ms):
        return np.flatnonzero(join._damaged(np.array(times_ms) * MS)).tolist()

    assert damaged(0, 10, 20, 30) == [] == damaged(0, 520) == damaged(0, 499, 20, 30)
    assert damaged(0, 600, 20, 30) == [1] and damaged(600, 1200, 50, 1300) == [2]
    assert damaged(511, 10, 20, 30) == [0] and damaged(509, 10, 20, 30) == []
    assert damaged(1000, 1010, 1020, 519) == [3] and damaged(1000, 1010, 1020, 521) == []
    # These times are not judged, because the times around them are a second apart
    assert damaged(0, 2000, 1001, 1011) == []


def test_late_samples_are_sorted_up_to_half_a_second():
    times = np.arange(200.0) * 10.0
    times[[50, 51]] = times[[51, 50]]
    values = np.tile(np.arange(200.0)[:, None], (1, 3))
    assert np.allclose(np.diff(join.in_order(sensor(times, values), "n").time_ns), 10 * MS)
    assert join.in_order(sensor(times, values), "n").values[50:52, 0].tolist() == [51.0, 50.0]


def test_a_sensor_needs_two_samples_and_at_most_10_khz():
    with pytest.raises(InputError, match="n: gyro has 1 samples"):
        join.in_order(sensor([0.0], name="gyro"), "n")
    assert len(join.in_order(sensor([0.0, 5.0]), "n").time_ns) == 2
    assert len(join.in_order(sensor(np.arange(30) / 9.9), "n").time_ns) == 30
    with pytest.raises(InputError, match="has 10100 samples per second, and no sensor has over 10000"):
        join.in_order(sensor(np.arange(30) / 10.1), "n")


def test_times_may_be_late_in_two_of_a_hundred_rows():
    for late, refused in ((2, False), (3, True)):
        times = np.arange(100.0) * 10.0
        times[np.arange(late) * 20 + 20] -= 75.0
        if refused:
            with pytest.raises(InputError, match=r"goes back 3 times, first in its row 21"):
                join.in_order(sensor(times), "n")
        else:
            join.in_order(sensor(times), "n")


def test_a_slower_sensor_is_interpolated_and_gaps_are_not():
    slow = sensor([0, 20, 200, 220], [[0.0] * 3, [2.0] * 3, [20.0] * 3, [22.0] * 3])
    found = join.on_clock(slow, np.array([-1, 0, 10, 20, 100, 200, 205, 221]) * MS, 10.0 * MS)
    assert found[:, 0] == pytest.approx([np.nan, 0.0, 1.0, 2.0, np.nan, 20.0, 20.5, np.nan], nan_ok=True)
    near = sensor([0, 170], [[0.0] * 3, [17.0] * 3])
    assert join.on_clock(near, np.array([50]) * MS, 200.0 * MS)[0, 0] == pytest.approx(5.0)


def test_a_faster_sensor_is_averaged():
    """The mean over 20 ms around 30 ms contains the samples after 20 ms and up to 40 ms. This window has two samples at
    steps of 10 ms, or four at steps of 5 ms."""
    values = np.array([0.0, 1.0, 4.0, 9.0, 16.0, 25.0, 36.0])[:, None] * [1.0, 1.0, 1.0]
    fast = sensor(np.arange(7) * 10.0, values)
    # Samples are not averaged if the step of the clock, here 15 ms, is at most 1.5 steps of the sensor
    assert join.on_clock(fast, np.array([30 * MS]), 15.0 * MS)[0, 0] == 9.0
    assert join._averaged(fast, 20.0 * MS)[:, 0] == pytest.approx([0.5, 2.5, 6.5, 12.5, 20.5, 30.5, 36.0])
    assert (
        join.on_clock(fast, np.array([30 * MS]), 15.2 * MS)[0, 0]
        == 9.0
        != join.on_clock(fast, np.array([30 * MS]), 20.0 * MS)[0, 0]
    )


def rows(track, times_ms, utc_ns=None):
    return join._on_rows(track, np.array(times_ms) * MS, utc_ns)


def test_a_fix_is_in_the_nearest_row_within_170_ms():
    found = rows(track([0.014, 0.5, 0.671], [5.0, 6.0, 7.0]), [0, 10, 20, 330, 1000], 10**9)
    assert found["speed_mps"] == pytest.approx([np.nan, 5.0, np.nan, 6.0, np.nan], nan_ok=True)
    assert found["utc_s"] == pytest.approx([1.0, 1.01, np.nan, 1.33, np.nan], nan_ok=True)
    alone = rows(None, [250, 260], 10**9)
    assert alone["utc_s"] == pytest.approx([1.25, np.nan], nan_ok=True)
    assert np.isnan(rows(track([0.0], [201.0], [200.5], [1.0]), [0, 10])["speed_mps"]).all()
    assert rows(track([0.0], [199.0]), [0, 10])["speed_mps"][0] == 199.0


def joined(accel, gyro, **more):
    return join.join(AppRecording("app", accel, gyro, **more), "n")


def test_sensors_are_joined_and_lost_rows_counted():
    """The gyro's readings last from 20 to 1000 ms, so two samples have no rate. No sensor can read 401 g."""
    accel = sensor(np.arange(0.0, 1010.0, 10.0))
    accel.values[50] = [0.0, 401.0, 0.0]
    accel.damaged, steady = 3, sensor(np.arange(20.0, 1010.0, 10.0), np.tile([1.0, 2.0, 3.0], (99, 1)), "gyro")
    steady.damaged = 5
    log, lost = joined(accel, steady, temp_c=np.arange(101.0))
    assert lost == 6 and len(log.t_s) == 98
    assert log.gyro_dps[0] == pytest.approx([1.0, 2.0, 3.0]) and log.temperature_c[:2].tolist() == [2.0, 3.0]
    assert np.isnan(joined(accel, steady, temp_c=np.arange(100.0))[0].temperature_c).all()
    assert log.start_s + log.t_s[0] == pytest.approx(0.02)


def test_many_readings_past_the_range_are_another_unit():
    accel, gyro = sensor(np.arange(100.0) * 10.0), sensor(np.arange(100.0) * 10.0, None, "gyro")
    accel.values[:2, 1] = 1e4
    assert joined(accel, gyro)[1] == 2
    accel.values[2, 1] = 1e4
    with pytest.raises(InputError, match=r"past any sensor's, up to 1e\+04 g and 1 deg/s: check their units"):
        joined(accel, gyro)


def test_gravity_is_added_to_the_users_acceleration():
    made = {"user": sensor([0, 10, 20]), "gravity": sensor([0, 10, 20], [[0.0, 0.0, 1.0]] * 3)}
    for one in made.values():
        one.taken.append(recording.Taken("accelerometer", "f", "g"))
    made["gravity"].damaged = 4
    found = join.with_gravity(made, made.__getitem__, "n", "whose", "remedy", "none")
    assert found.values[0].tolist() == [0.0, 1.0, 1.0] and found.damaged == 4 and len(found.taken) == 2
    assert join.with_gravity({"total", "user"}, lambda which: which, "n", "w", "r", "o") == "total"  # type: ignore
    for there, words in (({"gravity"}, "n: none"), ({"user"}, "n: gravity has been taken off its whose")):
        with pytest.raises(InputError, match=words):
            join.with_gravity(there, made.__getitem__, "n", "whose", "remedy", "none")


# importing.py


def log_of(count=100, start=0.0) -> Log:
    t_s = start + np.arange(count) / 10.0
    return Log(t_s, np.tile([0.0, 1.0, 0.0], (count, 1)), np.zeros((count, 3)), name="n")


@pytest.mark.parametrize(
    ("begin", "end", "count", "first"),
    [
        (None, None, 100, 0.0),
        (2.0, None, 80, 2.0),
        (2.0, 3.0, 11, 2.0),
        (-1.0, None, 11, 8.9),
        (None, -1.0, 90, 0.0),
        (-99.0, 0.1, 2, 0.0),
    ],
)
def test_a_stretch_counts_from_the_start_or_the_end(begin, end, count, first):
    found = importing._stretch(log_of(), begin, end)
    assert len(found.t_s) == count and found.start_s + found.t_s[0] == pytest.approx(first)


def test_an_empty_stretch_is_refused():
    with pytest.raises(InputError, match=r"n lasts 9\.9 s: there is nothing from 9\.9 s on"):
        importing._stretch(log_of(), 9.9, None)
    with pytest.raises(InputError, match="there is nothing from 3 to 2 s"):
        importing._stretch(log_of(), 3.0, 2.0)


def test_shortfalls_of_an_import():
    for hz, lasts, codes in ((19.6, 61.0, []), (19.4, 61.0, ["import-slow"]), (20.0, 9.0, ["import-short"])):
        t_s = np.arange(0.0, lasts, 1.0 / hz)
        zeros = np.zeros((len(t_s), 3))
        found = importing.Imported("a", Log(t_s, zeros, zeros), [])
        assert [one.code for one in found.shortfalls] == codes
        assert found.rate_hz == pytest.approx(hz)


def test_gaps_are_longer_than_170_ms():
    t_s = np.array([0.0, 0.1, 0.27, 0.441, 0.5])
    found = importing.Imported("a", Log(t_s, np.zeros((5, 3)), np.zeros((5, 3))), [])
    assert found.gaps_s == pytest.approx([0.171])


@pytest.mark.parametrize(("agrees", "sign"), [(True, "+1 g up"), (False, "-1 g up"), (None, "")])
def test_an_uncertain_sign_follows_the_track(monkeypatch, agrees, sign):
    monkeypatch.setattr(importing, "log_agrees", lambda *_: agrees)
    made = AppRecording("app", sensor([0, 10]), sensor([0, 10]), sign_known=False)
    made.accel.taken = [recording.Taken("time", "f", "s"), recording.Taken("accelerometer", "f", "g")]
    log = log_of(3)
    importing._check_sign(made, log)
    assert log.accel_g[0, 1] == (-1.0 if agrees is False else 1.0)
    assert made.accel.taken[0].sign == "" and made.accel.taken[1].sign.startswith(sign)
    assert [one.code for one in made.notices] == ([] if sign else ["import-sign"])
    made.sign_known, log.accel_g = True, log_of(3).accel_g
    importing._check_sign(made, log)
    assert log.accel_g[0, 1] == 1.0
