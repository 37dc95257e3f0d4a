"""A sensor axis that is dead, in standby or at the end of its range: the whole device reports it and shows no lean."""

import math

import pytest
from kickstand_tools.simulated_board import simulator
from support import device_plans

STATIC = 25
FAULT_S, END_S = 5.0, 8.0


@pytest.fixture
def aligned(tmp_path):
    """Return a flash with an alignment of the sensor with seed None."""
    device_plans.align(tmp_path)
    return tmp_path


@pytest.fixture
def spoilt(monkeypatch):
    """Return spoilt(column, value, from_s, until_s), which sets a column of the readings to a value from from_s to
    until_s."""

    def spoil(column, value, from_s, until_s):
        def installed(board):
            world = board.sensor.world

            def ill(t_s):
                reading = list(world(t_s))
                if from_s <= t_s < until_s:
                    reading[column] = value
                return reading

            board.sensor.world = ill
            install(board)

        install = simulator.Board.install
        monkeypatch.setattr(simulator.Board, "install", installed)

    return spoil


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [(3, 0.0, "Gyro x dead"), (5, -1 / 65.5, "Gyro z dead"), (2, 0.5, "Accel z stuck"), (4, 600.0, "Gyro clips")],
)
def test_a_faulty_axis_is_reported_and_the_lean_returns_with_it(column, value, said, spoilt, aligned, capsys):
    spoilt(column, value, FAULT_S, END_S)
    record = device_plans.run("cpython", aligned, {"lean": [[0, STATIC]], "until": 12}, capsys)
    assert record.lean_at(FAULT_S - 0.1) == STATIC
    assert FAULT_S < record.first(said, FAULT_S) < FAULT_S + 1.0
    assert record.leans(FAULT_S + 1.0, END_S) == []
    assert record.first("Lean", END_S) < END_S + 2.5
    assert set(record.leans(0, 12)) == {STATIC}
    assert "sensor: " in record.console


def test_with_a_dead_axis_no_pose_is_taken(spoilt, tmp_path):
    spoilt(3, 0.0, 0.0, 100.0)
    plan = {"ride": device_plans.RIDE, "presses": device_plans.PRESSES, "until": 20}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.first("hold|Aligned") == math.inf
    assert record.last[0].startswith("Gyro x dead")


def test_an_axis_that_dies_in_a_pose_ends_it(spoilt, tmp_path):
    first_s = device_plans.PRESSES[0][0]
    spoilt(3, 0.0, first_s + 1.0, 100.0)
    plan = {"ride": device_plans.RIDE, "presses": device_plans.PRESSES, "until": 20}
    record = device_plans.run("cpython", tmp_path, plan)
    assert record.first("hold") < first_s + 1.0
    assert record.first("Now upright|Aligned") == math.inf


def test_a_moment_at_the_end_of_the_range_hides_nothing_for_long(spoilt, aligned):
    """The display reports the fault. Soon after the fault the correct lean returns, because the bike is at rest."""
    spoilt(3, 600.0, FAULT_S, FAULT_S + 0.3)
    record = device_plans.run("cpython", aligned, {"lean": [[0, STATIC]], "until": 10})
    assert record.first("Gyro clips", FAULT_S) < FAULT_S + 0.5
    assert record.first("Lean +25", FAULT_S + 0.5) < FAULT_S + 3.0
    assert set(record.leans(0, 10)) == {STATIC}


def test_a_gyro_in_standby_is_set_up_again(aligned, monkeypatch):
    """The register PWR_MGMT_2 has a wrong value, as after a disturbed write."""
    install = simulator.Board.install

    def installed(board):
        board.at(FAULT_S, lambda: board.sensor._regs.__setitem__(0x6C, 7))
        install(board)

    monkeypatch.setattr(simulator.Board, "install", installed)
    record = device_plans.run("cpython", aligned, {"lean": [[0, STATIC]], "until": 8})
    assert record.first("Sensor reset", FAULT_S) < FAULT_S + 0.3
    assert record.lean_at(7.9) == STATIC
