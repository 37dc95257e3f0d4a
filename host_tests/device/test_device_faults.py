"""Faults of sensor, bus, display and flash on the whole device: shown while they last, gone soon after,
nothing wrong shown as good."""

import math
import time

import devices
import engines
import pytest
from kickstand_tools.simulated_board.mpu6050_registers import VARIANTS

STATIC = 25
FAULT_S, END_S = 5.0, 7.0
RECOVERY_S = 0.5
LCD_REINIT_S = 11.0


@pytest.fixture
def aligned(tmp_path):
    """A flash with an alignment in it, of the part with seed None."""
    devices.align(tmp_path)
    return tmp_path


def standing(faults, until=10, **more):
    """A bike that stands at 25 degrees, and what happens to the device."""
    return {"lean": [[0, STATIC]], "faults": faults, "until": until, **more}


def lasting(name):
    """Faults that last from FAULT_S to END_S, and what the display says meanwhile."""
    for_s = END_S - FAULT_S
    return {
        "nack": ([["nack_for", [0x68, FAULT_S, for_s]]], "No sensor"),
        "timeout": ([["timeout_for", [0x68, FAULT_S, for_s]]], "No sensor"),
        "unplugged": ([["unplug_sensor", [FAULT_S, for_s]]], "No sensor"),
        "frozen": ([["freeze", [FAULT_S, for_s]]], "Sensor silent"),
        "zeros": ([["all_zero", [FAULT_S, for_s]]], "Sensor frozen"),
        "ones": ([["all_ones", [FAULT_S, for_s]]], "Sensor frozen"),
    }[name]


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize("name", ["nack", "timeout", "unplugged", "frozen", "zeros", "ones"])
def test_a_fault_that_lasts(engine, name, aligned):
    faults, said = lasting(name)
    record = devices.run(engine, aligned, standing(faults))
    assert record.lean_at(FAULT_S - 0.1) == STATIC
    assert record.first(said, FAULT_S) < FAULT_S + 0.4
    back = record.first("Lean +25° right", END_S)
    assert back < END_S + RECOVERY_S + 0.1  # the record is taken every 0.1 s
    assert set(record.leans(0, 10)) == {STATIC}  # nothing else was ever shown as lean


@pytest.mark.parametrize("engine", engines.ENGINES)
@pytest.mark.parametrize(
    "fault",
    [
        ["supply_dip", [FAULT_S, "asleep"]],
        ["supply_dip", [FAULT_S, "frozen"]],
        ["supply_dip", [FAULT_S, "default_ranges"]],
        ["stuck_sda", [FAULT_S]],
        ["nack", [0x68, 300, 2]],
        ["timeout", [0x68, 300, 2]],
        ["lcd_slip", [FAULT_S]],
    ],
    ids=lambda fault: fault[0] + str(fault[1][-1]),
)
def test_a_fault_of_a_moment(engine, fault, aligned):
    record = devices.run(engine, aligned, standing([fault], until=18))
    assert record.lean_at(FAULT_S + 0.1 + RECOVERY_S + 0.1) == STATIC or fault[0] == "lcd_slip"
    assert record.lean_at(FAULT_S + LCD_REINIT_S) == STATIC
    assert record.last[0].startswith("Lean  25° right")
    if fault[0] != "lcd_slip":
        assert set(record.leans(0, 18)) == {STATIC}
    assert record.ends == ["off"]


def test_a_sample_that_a_supply_dip_has_torn_is_not_shown(aligned):
    dips = [["supply_dip", [FAULT_S + 1.013 * k, "torn"]] for k in range(20)]
    record = devices.run("cpython", aligned, standing(dips, until=30))
    assert set(record.leans(0, 30)) == {STATIC}
    assert record.first("Sensor reset", FAULT_S) < FAULT_S + 0.3


@pytest.mark.parametrize("mask", [0x01, 0x80])
def test_a_flipped_bit_passes_in_a_moment(mask, aligned):
    record = devices.run("cpython", aligned, standing([["corrupt", [0x68, 400, 0, mask]]], until=10))
    assert record.last[0].startswith("Lean  25° right")


def test_no_sensor_at_power_up_and_then_there_is_one(aligned):
    record = devices.run("cpython", aligned, standing([["unplug_sensor", [0, 4.0]]], until=6))
    assert record.at(1.0) == ["No sensor       ", "check wiring    "]
    assert record.lean_at(4.0 + RECOVERY_S + 0.1) == STATIC


def test_the_display_comes_and_goes(aligned):
    record = devices.run("cpython", aligned, standing([["unplug_lcd", [4.0, 3.0]]], until=10))
    assert record.at(6) == [" " * 16, " " * 16]
    assert record.lean_at(8.5) == STATIC
    assert record.ends == ["off"]


def test_without_a_display(aligned):
    plan = standing([], board={"lcd_address": None}, until=5)
    assert devices.run("cpython", aligned, plan).ends == ["off"]


@pytest.mark.parametrize("address", [0x27, 0x3F])
@pytest.mark.parametrize("one_bus", [False, True])
def test_either_display_address_and_one_bus_for_both(address, one_bus, aligned):
    config = {"LCD_SDA": 4, "LCD_SCL": 5} if one_bus else {}
    plan = standing([], board={"lcd_address": address, "one_bus": one_bus}, config=config, until=4)
    record = devices.run("cpython", aligned, plan)
    assert record.lean_at(3) == STATIC
    assert not record.too_fast


@pytest.mark.parametrize("who_am_i", sorted(VARIANTS))
def test_every_known_chip_is_accepted(who_am_i, tmp_path):
    plan = {"lean": [[0, STATIC]], "board": {"who_am_i": who_am_i}, "until": 3}
    assert devices.run("cpython", tmp_path, plan).at(1.5)[0].startswith("Raw   25°")


def test_an_unknown_chip_is_named_and_refused_unless_accepted(tmp_path):
    plan = {"lean": [[0, STATIC]], "board": {"who_am_i": 0x75}, "until": 3}
    assert devices.run("cpython", tmp_path, plan).last == ("Unknown sensor  ", "WHO_AM_I 0x75   ")
    accepted = {**plan, "config": {"ACCEPT_WHO_AM_I": 0x75}}
    assert devices.run("cpython", tmp_path, accepted).last[0].startswith("Raw   25°")


def test_the_calibration_of_another_chip_is_not_used(aligned):
    record = devices.run("cpython", aligned, standing([], board={"who_am_i": 0x70}, until=3))
    assert record.first("Not aligned") < math.inf
    assert devices.run("cpython", aligned, standing([], until=3)).lean_at(2.5) == STATIC


@pytest.mark.parametrize("fault", ["file_error", "file_empty"])
def test_a_sagging_supply_while_the_calibration_is_read(fault, aligned):
    files = {path.name: path.read_bytes() for path in aligned.iterdir()}
    record = devices.run("cpython", aligned, standing([[fault, [".cal", 0, 2]]], until=4))
    assert record.first("Not aligned") < math.inf
    assert {path.name: path.read_bytes() for path in aligned.iterdir()} == files  # nothing rewritten
    assert devices.run("cpython", aligned, standing([], until=3)).lean_at(2.5) == STATIC


@pytest.fixture
def in_turn_300(monkeypatch):
    """Call it with a function that takes the place of this turn of the app's loop, once."""
    from kickstand import app

    original, calls = app.App.turn, []

    def replace(function):
        def turn(self):
            calls.append(1)
            function() if len(calls) == 300 else original(self)

        monkeypatch.setattr(app.App, "turn", turn)

    return replace


def test_an_exception_is_said_and_the_board_restarts(aligned, in_turn_300, capsys):
    in_turn_300(lambda: 1 / 0)
    held = {"presses": [[3.0, 5.0]]}  # the button, all that time: no safe mode, which is for power-up
    record = devices.run("cpython", aligned, standing([], until=12, **held), capsys)
    assert record.first("Error, restarts") < math.inf
    assert record.first("ZeroDivisionErro") < math.inf
    assert record.ends == ["reset", "off"]
    assert record.lean_at(11) == STATIC


def test_a_loop_that_hangs_is_restarted_by_the_watchdog(aligned, in_turn_300):
    def hang():
        while True:
            time.sleep_ms(10)  # pyright: ignore[reportAttributeAccessIssue]

    in_turn_300(hang)
    record = devices.run("cpython", aligned, standing([], until=16))
    assert record.ends == ["reset", "off"]
    assert record.lean_at(15) == STATIC


@pytest.mark.parametrize("off_s", [0.4, 0.493, 0.5, 0.507, 0.514])
@pytest.mark.parametrize("lean", [-14, -30])
def test_a_sensor_lost_in_a_turn(lean, off_s, tmp_path):
    """A turn is as calm as standing and has no force to the side: coming back, it must not be taken for upright."""
    ride = [["kickstand", 8.0], ["upright", 8.0], ["accelerate", 20.0, 8.0], ["turn", 25.0, 3.0], ["turn", lean, 20.0]]
    plan = {"ride": ride, "presses": [[2, 0.15], [12, 0.15]], "until": 53}
    record = devices.run("cpython", tmp_path, {**plan, "faults": [["unplug_sensor", [40.0, off_s]]]})
    assert record.lean_at(39.5) == pytest.approx(lean, abs=2)
    assert record.first("No sensor|Sensor", 40) < 40.5
    assert all(abs(shown - lean) <= 7 for shown in record.leans(40.6, 52))  # "not sure yet" at first
    assert record.lean_at(51) == pytest.approx(lean, abs=3)


@pytest.fixture
def at_fault(monkeypatch):
    """Call it with a function of the board, which is called at FAULT_S. Returns a list that will hold the board."""
    from kickstand_tools.simulated_board import simulator

    original, boards = simulator.Board.install, []

    def arrange(function):
        def install(board):
            boards.append(board)
            board.at(FAULT_S, lambda: function(board))
            original(board)

        monkeypatch.setattr(simulator.Board, "install", install)
        return boards

    return arrange


@pytest.mark.parametrize("byte", [1, 2, 5])
def test_a_fifo_out_of_step_is_noticed(byte, aligned, at_fault):
    """Stray bytes in the FIFO: frames out of step would be read as readings for ever."""
    at_fault(lambda board: [board.sensor.fifo.push(0x55) for _ in range(byte)])
    record = devices.run("cpython", aligned, standing([], until=8))
    assert record.lean_at(FAULT_S + 0.3) == STATIC
    assert record.last[0].startswith("Lean  25° right")


@pytest.mark.parametrize(("register", "value"), [(0x1B, 0x18), (0x1C, 0x00), (0x1A, 0x06)])
def test_a_setting_that_changed_by_itself_is_put_right(register, value, aligned, at_fault):
    """Ranges and low-pass: the readings still come and look like readings, so that only the registers show it."""

    def spike(board):
        board.sensor.start(0x68, False)
        board.sensor.write_byte(register)
        board.sensor.write_byte(value)

    boards = at_fault(spike)
    record = devices.run("cpython", aligned, standing([], until=8))
    assert record.first("Sensor", FAULT_S) < FAULT_S + 0.3
    assert boards[0].sensor.peek(register) != value
    assert record.lean_at(FAULT_S + 0.1 + RECOVERY_S + 0.1) == STATIC
