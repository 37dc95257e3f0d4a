"""Rides that the simulated board records in flash or streams over USB: the replay shows what the display showed."""

import binascii
import contextlib
import gc
import warnings
from binascii import a2b_base64

import numpy as np
import pytest
from kickstand import console
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_log
from kickstand_tools.replay import replay_engine
from kickstand_tools.rides import ride_log
from support import device_plans, engines
from support.device_plans import ALIGNED

SHORT, LONG = 0.15, 1.2
ENGINES = ["cpython", *(pytest.param(engine, marks=pytest.mark.long) for engine in engines.ENGINES[1:])]


def menu(from_s):
    """Return the presses that choose "Record ride" or "Stop recording" in the menu. They take 8 s."""
    return [[from_s, LONG], *([from_s + i, SHORT] for i in (2, 3, 4, 5)), [from_s + 6, LONG]]


def rides(flash):
    """Return {number of a ride: its blocks}. The files must have no damage."""
    blocks_of = {}
    for path in sorted((flash / "rides").glob("*/*/*.rid")):
        blocks, problems = ride_log.read(path.read_bytes())
        assert problems == []
        for block in blocks:
            blocks_of.setdefault(block.ride, []).append(block)
    return blocks_of


def replayed(blocks, directory):
    """Return the lean that `replay` computes for each row of the ride's log."""
    cal = ride_log.write(directory / "ride.csv.gz", blocks)
    engine = replay_engine.Replay(read_calibration(cal).to_firmware())
    return [engine.step(*row)[0] for row in read_log(directory / "ride.csv.gz").rows()]


def lean_matches(record, blocks, leans, slack_s=0.4):
    """Assert that each displayed lean is within the replay's leans of the last slack_s. Return the number of compared
    leans."""
    begin_s = blocks[0].time_us / 1e6
    times = [turn.time_us / 1e6 for block in blocks for turn in block.turns]
    compared = 0
    for t_s, *_ in record.frames:
        displayed = record.lean_at(t_s)
        if displayed is None or not begin_s + slack_s < t_s < times[-1]:
            continue
        recent = [lean for t, lean in zip(times, leans, strict=True) if t_s - slack_s <= t <= t_s]
        assert min(recent) - 0.55 <= displayed <= max(recent) + 0.55, (t_s, displayed, recent)
        compared += 1
    return compared


@pytest.fixture(autouse=True)
def just_booted(monkeypatch):
    """Forget the slow prints of earlier tests. At the end, forget the files that a power cut has left open."""
    monkeypatch.setattr(console, "_slow_ms", None)
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.mark.parametrize("engine", ENGINES)
def test_recorded_ride_replays_as_the_display_showed(engine, tmp_path):
    """The board records from power-on. The board records one ride before the alignment and one after it. A power cut
    ends the second ride."""
    flash = tmp_path / "flash"
    flash.mkdir()
    record = device_plans.run(engine, flash, {**ALIGNED, "seed": 2, "config": {"RECORD": True}})
    first, second = (rides(flash)[number] for number in (1, 2))
    assert [block.sequence for block in second] == list(range(len(second)))
    assert second[0].calibration().aligned and not first[0].calibration().aligned
    leans = replayed(second, tmp_path)
    assert 46 - second[-1].turns[-1].time_us / 1e6 < 6.0  # at most one block is missing
    assert lean_matches(record, second, leans) > 50 and record.at(40)[0].endswith("*")


def test_menu_starts_and_ends_a_ride(tmp_path):
    device_plans.align(tmp_path)
    pages = [[16 + i, SHORT] for i in range(6)]
    plan = {"lean": [[0, 0], [20, 10]], "presses": [*menu(8), *pages, *menu(30)], "until": 40}
    record = device_plans.run("cpython", tmp_path, plan)
    assert 12 < record.first("Record ride") < 14
    assert record.at(15.9)[0].startswith("Rec         0:0") or record.at(15.9)[0].endswith("*")
    assert record.at(20.8)[0] in ("Rec         0:05", "Rec         0:06") and record.at(20.8)[1].startswith("room ")
    assert record.at(27)[0] == "Lean  10° right*"  # by now the filter has settled
    assert 34 < record.first("Stop recording") < 36 and record.first("Recording ended") < 38
    assert record.at(39.5)[0] == "Lean  10° right "
    (blocks,) = rides(tmp_path).values()
    assert 20 < (blocks[-1].turns[-1].time_us - blocks[0].time_us) / 1e6 < 25
    assert lean_matches(record, blocks, replayed(blocks, tmp_path)) > 0


@pytest.mark.parametrize("engine", engines.ENGINES[1:])
def test_recorded_ride_has_positions(engine, tmp_path):
    """Ten positions per second get from the receiver's wire to the log, even before a motorcycle's speed is
    confirmed."""
    position = [-33.5, -70.5, -1e-4, 2e-4]
    plan = {
        "ride": [["upright", 4.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 5.0]],
        "gps": {"hz": 10, "baud": 38400, "latency_s": 0.1, "place": position},
        "config": {"RECORD": True, "SPEED": "gps", "GPS_BAUD": 38400},
        "until": 14,
    }
    device_plans.run(engine, tmp_path, plan)
    (blocks,) = rides(tmp_path).values()
    ride_log.write(tmp_path / "ride.csv", blocks)
    log = read_log(tmp_path / "ride.csv")
    placed = np.isfinite(log.lat_deg)
    assert np.count_nonzero(placed) > 9.5 * (log.t_s[-1] - log.t_s[0]) - 10
    noon_s = 1_795_262_400.0  # noon on 21 November 2026, 20 s after the model's clock began
    fix_s = log.utc_s[placed] - (noon_s - 20.0)
    delay_s = log.t_s[placed] + blocks[0].time_us * 1e-6 - fix_s
    assert np.all((delay_s > 0.09) & (delay_s < 0.2))
    assert np.max(np.abs(log.lat_deg[placed] - (position[0] + position[2] * fix_s))) < 2e-6
    assert np.max(np.abs(log.lon_deg[placed] - (position[1] + position[3] * fix_s))) < 3e-6


# The stream over USB


@pytest.mark.parametrize("engine", ENGINES)
def test_sleeping_computer_ends_the_stream_and_the_lean_continues(engine, tmp_path, capsys):
    """Each print() takes half a second while the computer sleeps."""
    device_plans.align(tmp_path)
    capsys.readouterr()
    plan = {"stream": True, "lean": [[0, 0], [14, 20]], "faults": [["usb_asleep", [10.0, 600.0]]], "until": 25}
    record = device_plans.run(engine, tmp_path, plan, capsys)
    assert 10 < record.first("USB not read") < 13 and record.at(24)[0] == "Lean  20° right "
    assert record.first("Lean  20° right ") < 18  # as early as without a stream, so nothing delays the loop any more
    blocks, data = [], b""
    for line in record.console.splitlines():
        if line == ".":
            blocks.append(ride_log.parse(data))
            data = b""
        else:
            with contextlib.suppress(binascii.Error):
                data += a2b_base64(line)
    assert [block.sequence for block in blocks] == list(range(len(blocks))) and 15 < len(blocks) < 22
    assert record.ends[-1] == "off"  # the watchdog did not reset the board
