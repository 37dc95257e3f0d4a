"""Recording on the simulated board: a replay of the recorded ride gives the lean that the display showed."""

from itertools import pairwise

import pytest
from kickstand.lean.meter import LeanMeter
from kickstand.rides.flash_ring import RideRing
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_blocks
from kickstand_tools.replay import replay_engine
from kickstand_tools.rides import block_reader, ride_log
from kickstand_tools.simulated_board.simulator import Board
from support import device_plans, engines
from support.device_plans import ALIGNED

SHORT, LONG = 0.15, 1.2


def menu(from_s):
    """Return the presses that choose "Record ride" or "Stop recording" in the menu. They take 8 s."""
    return [[from_s, LONG], *([from_s + i, SHORT] for i in (2, 3, 4, 5)), [from_s + 6, LONG]]


def rides(flash):
    """Return {number of a ride: its whole blocks}, and a list of all problems."""
    found, problems = {}, []
    for path in sorted((flash / "rides").glob("*/*/*.rid")):
        blocks, bad = block_reader.read(path.read_bytes())
        problems += bad
        for block in blocks:
            found.setdefault(block.ride, []).append(block)
    return found, problems


def replayed(blocks, directory):
    """Return the lean that `replay` computes for each row of the ride's log."""
    cal = ride_log.write(directory / "ride.csv.gz", blocks)
    engine = replay_engine.Replay(read_calibration(cal).to_firmware())
    return [engine.step(*row)[0] for block in read_blocks(directory / "ride.csv.gz") for row in block.rows()]


def lean_matches(record, blocks, leans, slack_s=0.4):
    """Assert that each displayed lean is within the replay's leans of the last slack_s. Return the number of compared
    leans."""
    begun = blocks[0].time_us / 1e6
    times = [turn.time_us / 1e6 for block in blocks for turn in block.turns]
    compared = 0
    for t_s, *_ in record.frames:
        shown = record.lean_at(t_s)
        if shown is None or not begun + slack_s < t_s < times[-1]:
            continue
        late = [lean for t, lean in zip(times, leans, strict=True) if t_s - slack_s <= t <= t_s]
        assert min(late) - 0.55 <= shown <= max(late) + 0.55, (t_s, shown, late)
        compared += 1
    return compared


@pytest.fixture
def computed(monkeypatch):
    """Return a list that will contain every lean that the firmware computes on CPython."""
    leans = []
    update = LeanMeter.update_sum

    def noted(self, *arguments):
        update(self, *arguments)
        leans.append(self.lean_deg)

    monkeypatch.setattr(LeanMeter, "update_sum", noted)
    return leans


@pytest.mark.parametrize("engine", engines.ENGINES)
def test_a_recorded_ride_replays_as_the_display_showed(engine, tmp_path, computed):
    """The board records from power-on. The board records one ride before the alignment and one after it. A power cut
    ends the second ride."""
    flash = tmp_path / "flash"
    flash.mkdir()
    record = device_plans.run(engine, flash, {**ALIGNED, "seed": 2, "config": {"RECORD": True}})
    showed = list(computed)  # a copy, because the replay below computes leans as well
    found, problems = rides(flash)
    assert sorted(found) == [1, 2]
    assert problems == []
    assert [b.sequence for b in found[2]] == list(range(len(found[2])))
    assert found[2][0].calibration().aligned
    assert not found[1][0].calibration().aligned
    leans = replayed(found[2], tmp_path)
    assert 46 - found[2][-1].turns[-1].time_us / 1e6 < 6.0  # at most one block is missing
    assert lean_matches(record, found[2], leans) > 50
    if engine == "cpython":
        before = sum(len(block.turns) for block in found[1])
        exact = showed[before : before + len(leans)]
        assert max(abs(a - b) for a, b in zip(exact, leans, strict=True)) < 0.03
    assert record.at(40)[0].endswith("*")


def test_a_fault_of_the_sensor_in_a_ride_is_replayed(tmp_path, computed):
    """The firmware sets up the sensor again and restarts the filter. The ride continues in the same file."""
    device_plans.align(tmp_path)
    plan = {
        "ride": [["upright", 4.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 5.0], ["turn", 40.0, 5.0]],
        "faults": [["supply_dip", [16.0]]],
        "config": {"RECORD": True},
        "until": 30,
    }
    computed.clear()
    record = device_plans.run("cpython", tmp_path, plan)
    exact = list(computed)
    assert record.first("Sensor reset") < 18
    found, problems = rides(tmp_path)
    assert (list(found), problems) == ([1], [])
    steps = [b.time_us - a.time_us for a, b in pairwise(t for block in found[1] for t in block.turns)]
    assert [step > 500_000 for step in steps].count(True) == 1
    leans = replayed(found[1], tmp_path)
    assert max(abs(a - b) for a, b in zip(exact[: len(leans)], leans, strict=True)) < 0.05


def test_a_wheel_is_not_misread_while_flash_is_erased(tmp_path, monkeypatch):
    """Interrupts are off for 45 ms once per block. In these 45 ms the firmware notices only one of the wheel's edges,
    and notices it late."""
    boards, writes = [], []
    fit, write = Board.fit_wheel, RideRing.write

    def fitted(self, *arguments, **kind):
        fit(self, *arguments, **kind)
        boards.append(self)

    def erasing(self, piece):
        write(self, piece)
        writes.append(piece)
        if len(writes) % 16 == 0:
            wheel, missed = boards[0].wheel, []
            edge, wheel._edge = wheel._edge, missed.append
            boards[0].clock.advance(45_000)
            wheel._edge = edge
            if missed:
                edge(0 if wheel.closed else 1)

    monkeypatch.setattr(Board, "fit_wheel", fitted)
    monkeypatch.setattr(RideRing, "write", erasing)
    plan = {
        "ride": [["wait", 2.0], ["accelerate", 6.0, 3.0], ["straight", 300.0]],
        "wheel": {"pulses_per_metre": 3.0},
        "config": {"SPEED": "wheel", "PULSES_PER_METRE": 3.0, "RECORD": True, "VEHICLE": "car"},
        "until": 45,
    }
    device_plans.run("cpython", tmp_path, plan)
    assert len(writes) > 16 * 5
    turns = [turn for block in rides(tmp_path)[0][1] for turn in block.turns]
    speeds = [turn.speed_mps for turn in turns if turn.speed_mps is not None and turn.time_us > 8e6]
    assert len(speeds) > 200
    assert speeds == pytest.approx([6.0] * len(speeds), abs=0.1)


def test_the_menu_starts_and_ends_a_ride(tmp_path):
    device_plans.align(tmp_path)
    pages = [[16 + i, SHORT] for i in range(6)]
    plan = {"lean": [[0, 0], [20, 10]], "presses": [*menu(8), *pages, *menu(30)], "until": 40}
    record = device_plans.run("cpython", tmp_path, plan)
    assert 12 < record.first("Record ride") < 14
    assert record.at(15.9)[0].startswith("Rec         0:0") or record.at(15.9)[0].endswith("*")
    assert record.at(20.8)[0] in ("Rec         0:05", "Rec         0:06")
    assert record.at(20.8)[1].startswith("room ")
    assert record.at(27)[0] == "Lean  10° right*"  # by now the filter has settled
    assert 34 < record.first("Stop recording") < 36
    assert record.first("Recording ended") < 38
    assert record.at(39.5)[0] == "Lean  10° right "
    found, problems = rides(tmp_path)
    assert problems == []
    assert list(found) == [1]
    seconds = (found[1][-1].turns[-1].time_us - found[1][0].time_us) / 1e6
    assert 20 < seconds < 25
    assert lean_matches(record, found[1], replayed(found[1], tmp_path)) > 0
