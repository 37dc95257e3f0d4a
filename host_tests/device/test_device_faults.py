"""Faults of sensor, bus, display and flash on the whole device. The display shows a fault while it lasts and soon
recovers. The display never shows a wrong value as good."""

import math
import time

import pytest
from kickstand_tools.simulated_board import simulator
from support import device_plans

STATIC = 25
FAULT_S, LASTS_S, END_S = 5.0, 2.0, 7.0
RECOVERY_S = 0.5


@pytest.fixture
def aligned(tmp_path):
    """Return a flash with an alignment of the sensor with seed None."""
    device_plans.align(tmp_path)
    return tmp_path


def standing(faults, until=10, **more):
    """Return the plan of a bike at rest at 25 degrees, with these faults."""
    return {"lean": [[0, STATIC]], "faults": faults, "until": until, **more}


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ([["nack_for", [0x68, FAULT_S, LASTS_S]]], "No sensor"),
        ([["timeout_for", [0x68, FAULT_S, LASTS_S]]], "No sensor"),
        ([["unplug_sensor", [FAULT_S, LASTS_S]]], "No sensor"),
        ([["freeze", [FAULT_S, LASTS_S]]], "Sensor silent"),
        ([["all_zero", [FAULT_S, LASTS_S]]], "Sensor frozen"),
        ([["all_ones", [FAULT_S, LASTS_S]]], "Sensor frozen"),
    ],
)
def test_a_lasting_fault_is_shown_until_it_ends(faults, said, aligned):
    record = device_plans.run("cpython", aligned, standing(faults))
    assert record.lean_at(FAULT_S - 0.1) == STATIC
    assert record.first(said, FAULT_S) < FAULT_S + 0.4
    back = record.first("Lean +25° right", END_S)
    assert back < END_S + RECOVERY_S + 0.1  # frames of the record are 0.1 s apart
    assert set(record.leans(0, 10)) == {STATIC}  # the display shows no other lean


@pytest.mark.parametrize(
    ("engine", "fault"),
    [
        ("cpython", ["supply_dip", [FAULT_S, "asleep"]]),
        ("cpython", ["supply_dip", [FAULT_S, "frozen"]]),
        ("micropython", ["supply_dip", [FAULT_S, "default_ranges"]]),
        ("micropython", ["stuck_sda", [FAULT_S]]),
        ("cpython", ["nack", [0x68, 300, 2]]),
        ("micropython", ["timeout", [0x68, 300, 2]]),
    ],
    ids=str,
)
def test_a_short_fault_recovers_soon(engine, fault, aligned):
    record = device_plans.run(engine, aligned, standing([fault], until=8))
    assert record.lean_at(FAULT_S + 0.1 + RECOVERY_S + 0.1) == STATIC
    assert set(record.leans(0, 8)) == {STATIC}
    assert record.ends == ["off"]


def test_a_sample_damaged_by_a_supply_dip_is_not_shown(aligned):
    dips = [["supply_dip", [FAULT_S + 1.013 * k, "torn"]] for k in range(20)]
    record = device_plans.run("cpython", aligned, standing(dips, until=30))
    assert set(record.leans(0, 30)) == {STATIC}
    assert record.first("Sensor reset", FAULT_S) < FAULT_S + 0.3


@pytest.mark.parametrize("mask", [0x01, 0x80])
def test_a_flipped_bit_passes_in_a_moment(mask, aligned):
    record = device_plans.run("cpython", aligned, standing([["corrupt", [0x68, 400, 0, mask]]], until=10))
    assert record.last[0].startswith("Lean  25° right")


def test_no_sensor_at_power_up_and_then_there_is_one(aligned):
    record = device_plans.run("cpython", aligned, standing([["unplug_sensor", [0, 4.0]]], until=6))
    assert record.at(1.0) == ["No sensor       ", "check wiring    "]
    assert record.lean_at(4.0 + RECOVERY_S + 0.1) == STATIC


def test_an_unknown_chip_is_named_and_refused_unless_accepted(tmp_path):
    plan = {"lean": [[0, STATIC]], "board": {"who_am_i": 0x75}, "until": 3}
    assert device_plans.run("cpython", tmp_path, plan).last == ("Unknown sensor  ", "WHO_AM_I 0x75   ")
    accepted = {**plan, "config": {"ACCEPT_WHO_AM_I": 0x75}}
    assert device_plans.run("cpython", tmp_path, accepted).last[0].startswith("Raw   25°")


@pytest.mark.parametrize("fault", ["file_error", "file_empty"])
def test_a_sagging_supply_while_the_calibration_is_read(fault, aligned):
    files = {path.name: path.read_bytes() for path in aligned.iterdir()}
    record = device_plans.run("cpython", aligned, standing([[fault, [".cal", 0, 2]]], until=4))
    assert record.first("Not aligned") < math.inf
    # The firmware does not rewrite the flash
    assert {path.name: path.read_bytes() for path in aligned.iterdir()} == files
    assert device_plans.run("cpython", aligned, standing([], until=3)).lean_at(2.5) == STATIC


@pytest.fixture
def in_turn_300(monkeypatch):
    """Return a function that replaces pass 300 of the app's loop by a call of its argument."""
    from kickstand import app

    original, calls = app.App.turn, []

    def replace(function):
        def turn(self):
            calls.append(1)
            function() if len(calls) == 300 else original(self)

        monkeypatch.setattr(app.App, "turn", turn)

    return replace


def test_an_exception_is_reported_and_the_board_restarts(aligned, in_turn_300, capsys):
    in_turn_300(lambda: 1 / 0)
    held = {"presses": [[3.0, 5.0]]}  # the button is held during the restart, which does not start safe mode
    record = device_plans.run("cpython", aligned, standing([], until=12, **held), capsys)
    assert record.first("Error, restarts") < math.inf
    assert record.first("ZeroDivisionErro") < math.inf
    assert record.ends == ["reset", "off"]
    assert record.lean_at(11) == STATIC


def test_a_loop_that_hangs_is_restarted_by_the_watchdog(aligned, in_turn_300):
    def hang():
        while True:
            time.sleep_ms(10)  # pyright: ignore[reportAttributeAccessIssue]

    in_turn_300(hang)
    record = device_plans.run("cpython", aligned, standing([], until=16))
    assert record.ends == ["reset", "off"]
    assert record.lean_at(15) == STATIC


@pytest.mark.parametrize(("lean", "off_s"), [(-14, 0.507), (-30, 0.4)])
def test_a_sensor_lost_in_a_turn(lean, off_s, tmp_path):
    """In a steady turn the readings are as calm as at rest, without a force to the side. After the fault the firmware
    must not take the bike for upright."""
    ride = [["kickstand", 8.0], ["upright", 8.0], ["accelerate", 20.0, 8.0], ["turn", 25.0, 3.0], ["turn", lean, 20.0]]
    plan = {"ride": ride, "presses": [[2, 0.15], [12, 0.15]], "until": 53}
    record = device_plans.run("cpython", tmp_path, {**plan, "faults": [["unplug_sensor", [40.0, off_s]]]})
    assert record.lean_at(39.5) == pytest.approx(lean, abs=2)
    assert record.first("No sensor|Sensor", 40) < 40.5
    assert all(abs(shown - lean) <= 7 for shown in record.leans(40.6, 52))  # no lean is shown before 40.6 s
    assert record.lean_at(51) == pytest.approx(lean, abs=3)


def test_a_fifo_out_of_step_is_noticed(aligned, monkeypatch):
    """After stray bytes in the FIFO all later frames are shifted. Without a check the firmware would read wrong values
    forever."""
    install = simulator.Board.install

    def with_stray_bytes(board):
        board.at(FAULT_S, lambda: board.sensor.fifo.push(b"\x55" * 5))
        install(board)

    monkeypatch.setattr(simulator.Board, "install", with_stray_bytes)
    record = device_plans.run("cpython", aligned, standing([], until=8))
    assert record.lean_at(FAULT_S + 0.3) == STATIC
    assert record.last[0].startswith("Lean  25° right")


def test_a_changed_range_is_repaired(aligned, monkeypatch):
    """The readings continue and look normal. Only the register with the range shows the fault."""
    install, boards = simulator.Board.install, []

    def installed(board):
        def spike():
            board.sensor.start(0x68, False)
            board.sensor.write_byte(0x1C)
            board.sensor.write_byte(0x00)

        boards.append(board)
        board.at(FAULT_S, spike)
        install(board)

    monkeypatch.setattr(simulator.Board, "install", installed)
    record = device_plans.run("cpython", aligned, standing([], until=8))
    assert record.first("Sensor", FAULT_S) < FAULT_S + 0.3
    assert boards[0].sensor.peek(0x1C) != 0x00
    assert record.lean_at(FAULT_S + 0.1 + RECOVERY_S + 0.1) == STATIC
