"""The whole device, aligned by driving. A car finds its first alignment. On a motorcycle, driving checks and refines
the alignment that the two presses found. Some speed sources are unusable."""

import math
import re

import pytest
from kickstand.calibration.parameters import Calibration
from kickstand.calibration.store import Store
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import sensor_errors
from support import device_plans, engines
from support.board_access import level

SHORT, LONG = 0.15, 1.2
POSES = [[2, SHORT], [12, SHORT]]
POSES_S = 20.0


def town(blocks):
    """Return a ride as [[name of a manoeuvre, arguments...], ...].

    Each block lasts 30 s. The vehicle accelerates, turns, rides straight, brakes and then rests for 8 or 9 s.
    """
    ride = []
    for k in range(blocks):
        ride += [["accelerate", 13.0 + k % 3, 6.0], ["turn", -25.0 if k % 2 else 20.0, 3.0], ["straight", 5.0]]
        ride += [["brake", 0.0, 4.0 + k % 2], ["wait", 9.0 - k % 2]]
    return ride


def stops(time_s, start_s):
    """Return True if the vehicle is at rest at time_s. The blocks of town() begin at start_s."""
    return time_s < start_s or (time_s - start_s) % 30.0 > 21.0


def car(source, blocks=8, **plan):
    config = {"VEHICLE": "car", "SPEED": source, **plan.pop("config", {})}
    ride = [["wait", 6.0], *town(blocks)]
    return {"ride": ride, "seed": 3, source: {}, "until": 6.0 + 30.0 * blocks, **plan, "config": config}


def bike(source, blocks=8, kickstand=(-12.0,), **plan):
    config = {"SPEED": source, **plan.pop("config", {})}
    ride = [["kickstand", 8.0, *kickstand], ["upright", 10.0, 0.0, 0.0], *town(blocks)]
    until = POSES_S + 30.0 * blocks
    return {"ride": ride, "presses": POSES, source: {}, "until": until, **plan, "config": config}


def stored(flash):
    return Store(0x68, 8, str(flash)).load()


def forward_error_deg(calibration, seed=None):
    """Return the alignment's error in yaw, which driving corrects. seed: the sensor's seed."""
    true = sensor_errors.Sensor(seed=seed).vehicle_from_sensor
    up, forward = true[3:6], calibration.vehicle_from_sensor[6:9]
    left = sum(a * b for a, b in zip(true[0:3], forward, strict=True))
    ahead = sum(a * b for a, b in zip(true[6:9], forward, strict=True))
    assert abs(sum(a * b for a, b in zip(up, forward, strict=True))) < 0.15
    return abs(math.degrees(math.atan2(left, ahead)))


@pytest.mark.parametrize("engine", engines.ENGINES[1:])
def test_a_car_finds_its_alignment_and_shows_the_next_step(engine, tmp_path):
    """The first drive runs on MicroPython, to test its floats and its heap. The other drives run on CPython."""
    record = device_plans.run(engine, tmp_path, car("gps", 5, presses=[[60, SHORT], [65, SHORT]]))
    assert record.at(3.0) == ["Brakings   0/5  ", "stop needed     "]
    assert record.first("brake straight") < 8.0
    assert record.first("braking...") < 30.0
    assert record.at(62.0)[0].startswith("Raw")  # the first press has left the page of the alignment
    assert record.first("Brakings   [2-4]/5", 65.0) < 67.0
    saved = record.first("Aligned by drive")
    assert saved < 150.0 and stops(saved, 6.0)
    assert record.at(saved)[1].startswith("error about")
    assert record.first("Accel    0.3", saved) < math.inf  # the first page of a car
    calibration = stored(tmp_path)
    assert calibration.aligned and calibration.by_drive
    assert forward_error_deg(calibration, 3) < 1.5
    bias = sensor_errors.Sensor(seed=3).gyro_bias_dps
    assert list(calibration.gyro_bias) == pytest.approx(bias, abs=0.1)
    assert all(len(line) == 16 for frame in record.frames for line in frame[1:])
    again = device_plans.run(engine, tmp_path, car("gps", 1))
    assert again.at(2.0)[0].startswith(("Accel", "Brake")) and again.at(25.0)[0].startswith("Brake    0.")


def test_a_car_by_its_wheel_stores_at_standstill_only(tmp_path):
    """The alignment becomes ready in a braking event that ends at a slower speed, not at a stop."""
    plan = car("wheel", 2, wheel={"bounce_us": 2000})
    moving = [["brake", 4.0, 3.0], ["straight", 2.0], ["accelerate", 15.0, 6.0], ["straight", 5.0]]
    plan["ride"] += [["accelerate", 15.0, 6.0], ["straight", 5.0], *moving * 4, ["brake", 0.0, 5.0], ["wait", 8.0]]
    end = 66.0 + 11.0 + 4 * 16.0 + 13.0
    device_plans.run("cpython", tmp_path, {**plan, "until": end - 9.0})
    assert list(tmp_path.iterdir()) == []
    record = device_plans.run("cpython", tmp_path, {**plan, "until": end})
    assert record.first("Ready:") < end - 20.0 and record.first("Aligned by drive") > end - 9.0
    assert forward_error_deg(stored(tmp_path), 3) < 1.5


def test_a_car_finds_out_that_its_sensor_was_remounted(tmp_path):
    before = Calibration().with_alignment(sensor_errors.Sensor(seed=3).vehicle_from_sensor, [0.0] * 3, 0.0, True)
    Store(0x68, 8, str(tmp_path)).save(before)
    record = device_plans.run("cpython", tmp_path, car("wheel", 7, remount=[20.0, 8]))
    assert record.first("Aligned by drive") < math.inf
    after, true = stored(tmp_path).vehicle_from_sensor, sensor_errors.random_mounting(8)
    # the sensor's errors cause an error of up to 4 degrees
    assert max(abs(a - b) for a, b in zip(after, true, strict=True)) < 0.12
    assert max(abs(a - b) for a, b in zip(before.vehicle_from_sensor, true, strict=True)) > 0.5


QUESTION = "Side was wrong"
TURN_S = POSES_S + 30.0 * 2 + 9.0  # a time in a right bend with a lean of 20 degrees


@pytest.fixture(scope="module")
def unanswered(tmp_path_factory):
    """Return the Record of a ride. The kickstand is not on the side that is set, and the rider does not answer the
    question."""
    return device_plans.run("cpython", tmp_path_factory.mktemp("asked"), bike("gps", 3, kickstand=(12.0,)))


@pytest.fixture
def asked(unanswered):
    """Return the time at which the display asks about the side."""
    return unanswered.first(QUESTION)


def test_a_wrong_kickstand_side_is_noticed(unanswered, asked):
    assert asked < POSES_S + 60.0 and stops(asked, POSES_S)
    assert unanswered.at(asked)[1] == "hold = fix      "
    away = unanswered.first("Lean", asked)
    assert not stops(away, POSES_S)  # the question disappears while the bike rides
    assert unanswered.lean_at(TURN_S) is None  # the lean is hidden, because its sign is uncertain
    assert unanswered.at(TURN_S) == ["Lean  --        ", "side was wrong? "]


def test_a_wrong_kickstand_side_is_corrected(asked, tmp_path):
    fixed = device_plans.run(
        "cpython", tmp_path, bike("gps", 3, kickstand=(12.0,), presses=[*POSES, [asked + 1, LONG]])
    )
    assert fixed.first("Side corrected") < asked + 3.0
    assert fixed.lean_at(TURN_S) == pytest.approx(20, abs=4)
    assert fixed.first(QUESTION, asked + 3.0) == math.inf
    assert forward_error_deg(stored(tmp_path)) < 2.0


def test_a_side_that_the_rider_confirms_is_not_asked_for_again(asked, tmp_path):
    record = device_plans.run(
        "cpython", tmp_path, bike("gps", 3, kickstand=(12.0,), presses=[*POSES, [asked + 1, SHORT]])
    )
    assert record.first(QUESTION, asked + 2.0) == math.inf
    assert not stored(tmp_path).by_drive


@pytest.mark.parametrize(("model", "config"), [({"until_s": 65.0}, {}), ({}, {"PULSES_PER_METRE": 0.25})])
def test_a_wheel_that_misleads_does_not_spoil_the_lean(model, config, tmp_path):
    """If the wheel's wire breaks during the ride, the measured speed stays 0. With a second magnet the measured speed
    is twice the true speed. The display reports either fault at the next stop."""
    plan = bike("wheel", 6, wheel=model, config={"SPEED": "wheel", **config})
    record = device_plans.run("cpython", tmp_path, plan)
    for town_round in range(6):
        shown = record.lean_at(POSES_S + 30.0 * town_round + 9.0)
        assert shown == pytest.approx(-25 if town_round % 2 else 20, abs=4)
    shown_s = record.first("Speed (stuck at|2.0 times)")
    assert stops(shown_s, POSES_S)
    assert record.at(shown_s + 2.0) == record.at(shown_s)  # the report stays until the rider answers or rides on


def test_errors_of_both_poses_are_found_while_riding(tmp_path):
    """A pitch of two degrees on the kickstand gives a yaw error of almost ten degrees. The firmware refines forward at
    a stop, and at most 1.5 degrees remain. The upright pose was 2 degrees off, which the trim corrects. The new
    alignment keeps the trim and the maxima."""
    plan = bike("wheel", 8, kickstand=(-12.0, 2.0))
    plan["ride"][1] = ["upright", 10.0, 2.0, 0.0]
    first = device_plans.run("cpython", tmp_path, {**plan, "until": 19.0})
    assert first.first("Aligned!") < 19.0
    assert forward_error_deg(stored(tmp_path)) > 7.0
    record = device_plans.run("cpython", tmp_path, {**plan, "presses": [[POSES_S + 232.0, SHORT]]})
    assert forward_error_deg(stored(tmp_path)) < 1.5
    assert stored(tmp_path).by_drive
    for town_round in range(3, 7):
        assert record.lean_at(POSES_S + 30.0 * town_round - 1.0) in (-1, 0, 1)  # the bike is upright here
    assert record.first("Max right +(19|2[0-9])°", POSES_S + 232.0) < math.inf


def test_a_moved_mount_hides_the_lean_despite_other_messages(tmp_path):
    """Later the wheel's wire also breaks, before the rider has answered the first message."""
    record = device_plans.run(
        "cpython", tmp_path, bike("wheel", 6, remount=[POSES_S + 60.0, 8], wheel={"until_s": 130.0})
    )
    moved = record.first("Mount has moved")
    assert moved > POSES_S + 60.0 and stops(moved, POSES_S)
    assert moved < record.first("Speed stuck") < math.inf
    assert not record.leans(moved, 500.0)


def test_a_requested_drive_keeps_the_old_alignment_until_ready(tmp_path):
    """The rider has remounted the sensor and starts alignment by driving in the menu. During the drive the sensor
    fails for a moment, without harm."""
    device_plans.align(tmp_path)
    old = list(stored(tmp_path).vehicle_from_sensor)
    menu = [[2, LONG], *([4 + t, SHORT] for t in range(4)), [9, LONG]]
    plan = {"ride": [["upright", 18.0], *town(5)], "seed": 8, "config": {"SPEED": "gps"}, "gps": {"hz": 5}}
    plan |= {"presses": menu, "faults": [["nack_for", [0x68, 70.0, 2.0]]]}
    device_plans.run("cpython", tmp_path, {**plan, "until": 60.0})
    assert list(stored(tmp_path).vehicle_from_sensor) == old
    record = device_plans.run("cpython", tmp_path, {**plan, "until": 170.0})
    assert record.at(8.5)[0] == "→Align by drive "
    assert record.first("Brakings") < 12.0
    assert record.first("Aligned by drive") < math.inf
    assert forward_error_deg(stored(tmp_path), 8) < 2.0


@pytest.mark.parametrize(
    ("source", "model", "config", "blocks", "said"),
    [
        ("gps", {"faults": [["void", 0, 1000]]}, {}, 2, "GPS: no fix"),
        ("gps", {"faults": [["stuck", 40, 1000]]}, {}, 2, "GPS: no fix"),
        ("gps", {"latency_s": 2.5}, {}, 5, "Speed 2.. s late"),
        ("wheel", {}, {"PULSES_PER_METRE": 0.5 / 3.6}, 5, "Speed 3.. times"),
        ("wheel", {"until_s": 40.0}, {}, 3, "Speed stuck at"),
    ],
)
def test_an_unusable_speed_is_reported_and_nothing_is_stored(source, model, config, blocks, said, tmp_path):
    record = device_plans.run("cpython", tmp_path, {**car(source, blocks, config=config), source: model})
    assert record.first(said) < math.inf, {tuple(f[1:]) for f in record.frames}
    assert list(tmp_path.iterdir()) == []


def test_a_temporary_loss_of_speed_is_reported_and_harmless(tmp_path):
    faults = [["unplugged", 15, 30], ["garbled", 45, 62]]
    record = device_plans.run("cpython", tmp_path, car("gps", 6, gps={"faults": faults}))
    assert record.first("GPS silent") == pytest.approx(21.0, abs=3.0)
    assert record.first("GPS garbled") == pytest.approx(51.0, abs=4.0)
    assert record.first("Aligned by drive") < math.inf
    assert forward_error_deg(stored(tmp_path), 3) < 1.5


@pytest.mark.parametrize(
    ("config", "named"),
    [
        ({"LCD_I2C": 0}, "LCD_I2C"),
        ({"VEHICLE": "car"}, "car needs SPEED"),
        ({"VEHICLE": "bus", "SPEED": "gps"}, "VEHICLE"),
        ({"SPEED": "gps", "GPS_RX": 5}, "pin used twice"),
        ({"SPEED": "wheel", "PULSES_PER_METRE": 0}, "PULSES_PER_METRE"),
        ({"SPEED": "gps", "GPS_BAUD": "9600"}, "GPS_BAUD"),
        ({"SPEED": "gps", "GPS_RX": 11}, "GPS_TX / GPS_RX"),
    ],
)
def test_a_wrong_setting_is_named(config, named):
    with Board(level):
        from kickstand.errors import SettingsError
        from kickstand.settings import Settings
        from kickstand.speed.source import open_speed
        from kickstand.ui import messages

        with pytest.raises(SettingsError) as refusal:
            open_speed(Settings(type("Config", (), config)))
        assert named in (refusal.value.values[0], messages.lines(refusal.value)[1])


@pytest.mark.parametrize(
    ("config", "fitted", "said"),
    [
        ({}, {}, "Speed        no source"),
        ({"SPEED": "gps"}, {"gps": {}}, "RX 9, 9600 baud:\n  15.0 m/s"),
        ({"SPEED": "gps"}, {}, "RX 9, 9600 baud:\n  GPS silent, check wiring"),
        ({"SPEED": "wheel"}, {"wheel": {}}, "GPIO 14, 0.50 pulses a metre:\n  15.0 m/s"),
    ],
)
def test_status_shows_the_speed(config, fitted, said, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with Board(level) as board:
        for source, kind in fitted.items():
            getattr(board, "fit_" + source)(lambda t_s: 15.0, **kind)
        from kickstand import settings, status_report

        monkeypatch.setattr(status_report, "load", lambda: settings.Settings(type("Config", (), config)))
        monkeypatch.setattr(status_report.gc, "mem_free", lambda: 0, raising=False)
        assert board.run(status_report.report, 20.0) == "returned"
    printed = capsys.readouterr().out
    assert said in printed and "aligned: no" in printed


def test_ctrl_c_keeps_the_worst_for_the_status(tmp_path, monkeypatch, capsys):
    """Other code keeps the processor busy for 0.25 s. The status then reports the longest pass of the loop, and the
    room that was left in the FIFO."""
    monkeypatch.chdir(tmp_path)

    def interrupt():
        raise KeyboardInterrupt

    with Board(
        sensor_errors.resting(sensor_errors.Sensor(), (0, 1, 0))
    ) as board:  # lean the sensor a little, because a perfectly level sensor would look frozen
        from kickstand import app, devices, settings, status_report
        from kickstand.lean import consistency

        monkeypatch.setattr(app, "worst", None)
        monkeypatch.setattr(consistency, "last_odd", "odd-up")
        monkeypatch.setattr(status_report.gc, "mem_free", lambda: 0, raising=False)
        chosen = settings.Settings(None)
        monkeypatch.setattr(status_report, "load", lambda: chosen)
        board.faults.busy(2.0, 0.25)
        board.at(3.0, interrupt)

        def run():
            app.App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen)).run()

        with pytest.raises(KeyboardInterrupt):
            board.run(run, 10.0)
        board.run(status_report.report, 20.0)
    words = r"Since start  longest turn ([\d.]+) ms; places left in the FIFO, at the fewest: (\d+)"
    said = capsys.readouterr().out
    assert "again and again: force up" in said
    found = re.search(words, said)
    assert found
    assert 245.0 < float(found[1]) < 275.0
    assert 15 <= int(found[2]) <= 25


def test_a_press_for_a_page_does_not_answer_a_hidden_question(asked, tmp_path):
    """The page with the sensor's information hides the question."""
    plan = bike("gps", 3, kickstand=(12.0,))
    to_info = [[asked - 14.0, LONG], *([asked - 12.0 + t, SHORT] for t in range(3)), [asked - 9.0, LONG]]
    presses = [*POSES, *to_info, [asked + 2.0, LONG]]
    record = device_plans.run("cpython", tmp_path, {**plan, "presses": presses, "until": asked + 4.0})
    assert record.at(asked + 1.0)[0].startswith("MPU6050")
    assert record.at(asked + 3.5)[1].startswith("next")  # the menu
    assert not stored(tmp_path).by_drive
