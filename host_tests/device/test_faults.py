"""Faults of sensor, wires, supply, display and flash on a bike that leans by 25 degrees. The display names the fault
while it lasts, recovers soon, and never shows another lean."""

import pytest
from support.device_plans import spoilt

LEAN = 25
FAULT_S, END_S = 2.0, 4.0
SENSOR = 0x68
PWR_MGMT_2, ACCEL_CONFIG = 0x6C, 0x1C


def constant(column, value, from_s=FAULT_S, until_s=END_S):
    return spoilt(column, lambda _: value, from_s, until_s)


def written(register, value):
    """Return fit(board), which changes a register of the sensor at FAULT_S, as a disturbed transfer does."""

    def write(sensor):
        sensor.start(SENSOR, False)
        sensor.write_byte(register)
        sensor.write_byte(value)

    return lambda board: board.at(FAULT_S, lambda: write(board.sensor))


def stray_bytes(board):
    board.at(FAULT_S, lambda: board.sensor.fifo.push(b"\x55" * 5))


def standing(until_s, *faults, **more):
    return {"lean": [[0, LEAN]], "faults": list(faults), "until": until_s, **more}


LASTING = {
    "no acknowledge": (["nack_for", [SENSOR, FAULT_S, 2.0]], "No sensor", 0.4, 0.6),
    "unplugged": (["unplug_sensor", [FAULT_S, 2.0]], "No sensor", 0.4, 0.6),
    "frozen data": (["freeze", [FAULT_S, 2.0]], "Sensor silent", 0.4, 0.6),
    "ones": (["all_ones", [FAULT_S, 2.0]], "Sensor frozen", 0.4, 0.6),
    "gyro x constant": (constant(3, 0.0), "Gyro x dead", 1.0, 2.5),
    "gyro z constant": (constant(5, -1 / 65.5), "Gyro z dead", 1.0, 2.5),
    "accelerometer constant": (constant(2, 0.5), "Accel z stuck", 1.0, 2.5),
    "gyro at its limit": (constant(4, 600.0), "Gyro clips", 1.0, 2.5),
}


def run_with(run, until_s, fault, engine="cpython"):
    if callable(fault):
        return run(standing(until_s), engine, fault)
    return run(standing(until_s, fault), engine)


@pytest.mark.parametrize("name", LASTING)
@pytest.mark.usefixtures("aligned")
def test_lasting_fault_is_shown_until_it_ends(name, run):
    fault, words, shown_s, back_s = LASTING[name]
    record = run_with(run, 7.0, fault)
    assert record.lean_at(FAULT_S - 0.1) == LEAN
    assert FAULT_S < record.first(words, FAULT_S) < FAULT_S + shown_s
    assert record.leans(FAULT_S + shown_s, END_S) == []
    assert record.first("Lean +25° right", END_S) < END_S + back_s
    assert set(record.leans(0, 7)) == {LEAN}


SHORT = {
    "sleep": ("cpython", ["supply_dip", [FAULT_S, "asleep"]], "Sensor reset"),
    "other ranges": ("micropython", ["supply_dip", [FAULT_S, "default_ranges"]], "Sensor reset"),
    "SDA held low": ("micropython", ["stuck_sda", [FAULT_S]], None),
    "two not acknowledged": ("cpython", ["nack", [SENSOR, 150, 2]], None),
    "gyro in standby": ("cpython", written(PWR_MGMT_2, 7), "Sensor reset"),
    "range changed": ("cpython", written(ACCEL_CONFIG, 0), "Sensor"),
    "stray bytes in the FIFO": ("cpython", stray_bytes, None),
    "gyro at its limit for 0.3 s": ("cpython", constant(3, 600.0, FAULT_S, FAULT_S + 0.3), "Gyro clips"),
}


@pytest.mark.parametrize("name", SHORT)
@pytest.mark.usefixtures("aligned")
def test_short_fault_recovers_soon(name, run):
    engine, fault, words = SHORT[name]
    record = run_with(run, FAULT_S + 3.0, fault, engine)
    assert record.ends == ["off"]
    assert words is None or FAULT_S < record.first(words, FAULT_S) < FAULT_S + 0.5
    assert record.lean_at(FAULT_S + (2.9 if words == "Gyro clips" else 0.7)) == LEAN
    assert set(record.leans(0, FAULT_S + 3.0)) == {LEAN}


@pytest.mark.parametrize("fault", ["file_error", "file_empty"])
def test_unreadable_calibration_is_not_overwritten(fault, aligned, run):
    """The supply sags while the calibration is read."""
    files = {path.name: path.read_bytes() for path in aligned.iterdir()}
    record = run(standing(3, [fault, [".cal", 0, 2]]))
    assert record.first("Not aligned") < 3
    assert {path.name: path.read_bytes() for path in aligned.iterdir()} == files
    assert run(standing(2)).lean_at(1.5) == LEAN


def fails(board):
    board.at(3.0, lambda: 1 / 0)


@pytest.mark.usefixtures("aligned")
def test_exception_is_shown_and_the_board_restarts(run):
    """A button that is held during the restart does not start safe mode."""
    record = run(standing(9, presses=[[3.0, 5.0]]), fit=fails)
    assert record.first("Error, restarts") < record.first("ZeroDivisionErro") < 3.5
    assert record.ends == ["reset", "off"] and record.lean_at(8.5) == LEAN


@pytest.mark.parametrize(("watchdog", "ends"), [(True, ["reset", "off"]), (False, ["off"])])
@pytest.mark.usefixtures("aligned")
def test_hanging_loop_is_restarted_by_the_watchdog(watchdog, ends, run):
    record = run(standing(13, ["busy", [2.0, 9.0]], config={"WATCHDOG": watchdog}))
    assert record.ends == ends
    assert record.lean_at(12.5) == LEAN


@pytest.mark.parametrize(("lean", "off_s"), [(-14, 0.507), pytest.param(-30, 0.4, marks=pytest.mark.long)])
@pytest.mark.usefixtures("aligned")
def test_sensor_lost_in_a_turn(lean, off_s, run):
    """In a steady turn the readings are as calm as at rest, without a force to the side. After the fault the bike must
    not be taken for upright."""
    ride = [["upright", 2.0], ["accelerate", 20.0, 6.0], ["turn", 25.0, 2.0], ["turn", lean, 22.0]]
    record = run({"ride": ride, "faults": [["unplug_sensor", [20.0, off_s]]], "until": 34})
    assert record.lean_at(19.5) == pytest.approx(lean, abs=2)
    assert record.first("No sensor|Sensor", 20) < 20.5
    assert all(abs(displayed - lean) <= 7 for displayed in record.leans(20.6, 33.5))
    assert record.lean_at(33) == pytest.approx(lean, abs=3)


@pytest.mark.parametrize("from_s", [0.0, 3.0])
def test_no_pose_is_taken_with_a_dead_axis(from_s, run, tmp_path):
    """The axis is dead from the start, or dies during the first pose."""
    plan = {"lean": [[0, -12], [8, 0]], "presses": [[2, 0.15], [10, 0.15]], "until": 15}
    record = run(plan, fit=constant(3, 0.0, from_s, 100.0))
    assert record.first("Now upright|Aligned") == float("inf")
    assert (record.first("hold") < 3.0) is (from_s > 0)
    assert record.last[0].startswith("Gyro x dead") and list(tmp_path.iterdir()) == []
