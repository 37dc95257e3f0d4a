"""Rides that the simulated board records in flash or streams over USB: the replay shows what the display showed."""

import binascii
import contextlib
import gc
import io
import re
import warnings
from binascii import a2b_base64
from itertools import pairwise

import numpy as np
import pytest
from kickstand import console, errors
from kickstand.lean.meter import LeanMeter
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_blocks, read_log
from kickstand_tools.replay import replay_engine
from kickstand_tools.rides import block_reader, ride_log
from kickstand_tools.simulated_board.simulator import Board
from kickstand_tools.simulation.scripted import script
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
        blocks, problems = block_reader.read(path.read_bytes())
        assert problems == []
        for block in blocks:
            blocks_of.setdefault(block.ride, []).append(block)
    return blocks_of


def replayed(blocks, directory):
    """Return the lean that `replay` computes for each row of the ride's log."""
    cal = ride_log.write(directory / "ride.csv.gz", blocks)
    engine = replay_engine.Replay(read_calibration(cal).to_firmware())
    return [engine.step(*row)[0] for block in read_blocks(directory / "ride.csv.gz") for row in block.rows()]


def lean_matches(record, blocks, leans, slack_s=0.4):
    """Assert that each displayed lean is within the replay's leans of the last slack_s. Return the number of compared
    leans."""
    begin_s = blocks[0].time_us / 1e6
    times = [turn.time_us / 1e6 for block in blocks for turn in block.turns]
    compared = 0
    for t_s, *_ in record.frames:
        shown = record.lean_at(t_s)
        if shown is None or not begin_s + slack_s < t_s < times[-1]:
            continue
        recent = [lean for t, lean in zip(times, leans, strict=True) if t_s - slack_s <= t <= t_s]
        assert min(recent) - 0.55 <= shown <= max(recent) + 0.55, (t_s, shown, recent)
        compared += 1
    return compared


class Watch:
    """Notes the meter's results in each pass of the loop on CPython, as (time in s, lean in degrees, trusted, dt in
    s)."""

    def __init__(self, monkeypatch):
        self.turns, boards = [], []
        created, update = Board.__init__, LeanMeter.update_sum

        def creating(board, *arguments, **named):
            created(board, *arguments, **named)
            boards.append(board)

        def updating(meter, sums, n, dt_us):
            update(meter, sums, n, dt_us)
            if boards:
                self.turns.append((boards[-1].clock.now_us / 1e6, meter.lean_deg, meter.trusted, dt_us / 1e6))

        monkeypatch.setattr(Board, "__init__", creating)
        monkeypatch.setattr(LeanMeter, "update_sum", updating)


@pytest.fixture(autouse=True)
def just_booted(monkeypatch):
    """Forget the slow prints of earlier tests. At the end, forget the files that a power cut has left open."""
    monkeypatch.setattr(console, "_slow_ms", None)
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.fixture
def watch(monkeypatch):
    return Watch(monkeypatch)


@pytest.mark.parametrize("engine", ENGINES)
def test_recorded_ride_replays_as_the_display_showed(engine, tmp_path, watch):
    """The board records from power-on. The board records one ride before the alignment and one after it. A power cut
    ends the second ride."""
    flash = tmp_path / "flash"
    flash.mkdir()
    record = device_plans.run(engine, flash, {**ALIGNED, "seed": 2, "config": {"RECORD": True}})
    computed = [lean for _, lean, *_ in watch.turns]
    first, second = (rides(flash)[number] for number in (1, 2))
    assert [block.sequence for block in second] == list(range(len(second)))
    assert second[0].calibration().aligned and not first[0].calibration().aligned
    leans = replayed(second, tmp_path)
    assert 46 - second[-1].turns[-1].time_us / 1e6 < 6.0  # at most one block is missing
    assert lean_matches(record, second, leans) > 50 and record.at(40)[0].endswith("*")
    if engine == "cpython":
        begin = sum(len(block.turns) for block in first)
        exact = computed[begin : begin + len(leans)]
        assert max(abs(a - b) for a, b in zip(exact, leans, strict=True)) < 0.03


def test_fault_of_the_sensor_in_a_ride_is_replayed(tmp_path, watch):
    """The firmware sets up the sensor again and restarts the filter. The ride continues in the same file."""
    device_plans.align(tmp_path)
    plan = {
        "ride": [["upright", 3.0], ["accelerate", 15.0, 4.0], ["turn", -30.0, 4.0], ["turn", 40.0, 4.0]],
        "faults": [["supply_dip", [9.0]]],
        "config": {"RECORD": True},
        "until": 20,
    }
    watch.turns.clear()
    record = device_plans.run("cpython", tmp_path, plan)
    exact = [lean for _, lean, *_ in watch.turns]
    assert record.first("Sensor reset") < 11
    (blocks,) = rides(tmp_path).values()
    times = [turn.time_us for block in blocks for turn in block.turns]
    assert [after - before > 500_000 for before, after in pairwise(times)].count(True) == 1
    leans = replayed(blocks, tmp_path)
    assert max(abs(a - b) for a, b in zip(exact[: len(leans)], leans, strict=True)) < 0.05


@pytest.mark.long
def test_wheel_is_not_misread_while_flash_is_erased(tmp_path):
    """Interrupts are off for 45 ms once per block. In these 45 ms the firmware notices only one of the wheel's edges,
    and notices it late."""
    plan = {
        "ride": [["wait", 2.0], ["accelerate", 6.0, 3.0], ["straight", 300.0]],
        "wheel": {"pulses_per_metre": 3.0},
        "faults": [["slow_flash", [0.0, 1000.0, 0.045]]],
        "config": {"SPEED": "wheel", "PULSES_PER_METRE": 3.0, "RECORD": True, "VEHICLE": "car"},
        "until": 45,
    }
    device_plans.run("cpython", tmp_path, plan)
    turns = [turn for block in rides(tmp_path)[1] for turn in block.turns]
    speeds = [turn.speed_mps for turn in turns if turn.speed_mps is not None and turn.time_us > 8e6]
    assert len(speeds) > 200 and speeds == pytest.approx([6.0] * len(speeds), abs=0.1)


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
    place = [-33.5, -70.5, -1e-4, 2e-4]
    plan = {
        "ride": [["upright", 4.0], ["accelerate", 15.0, 6.0], ["turn", -30.0, 5.0]],
        "gps": {"hz": 10, "baud": 38400, "latency_s": 0.1, "place": place},
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
    assert np.max(np.abs(log.lat_deg[placed] - (place[0] + place[2] * fix_s))) < 2e-6
    assert np.max(np.abs(log.lon_deg[placed] - (place[1] + place[3] * fix_s))) < 3e-6


# The flash is so slow that an erase takes longer than the sensor's FIFO keeps samples

BENDS = device_plans.RIDE[:3] + [["turn", -40.0, 3.0], ["turn", 40.0, 3.0]] * 6 + [["straight", 6.0]]
FROM_S, UNTIL_S = 22.0, 70.0


@pytest.mark.parametrize(
    ("who_am_i", "erase_s", "fifo_s"),
    [(0x68, 0.40, 0.365), pytest.param(0x70, 0.25, 0.180, marks=pytest.mark.long)],
    ids=["1024 bytes", "512 bytes"],
)
def test_loss_is_counted_and_its_wrong_lean_is_not_shown(who_am_i, erase_s, fifo_s, tmp_path, watch):
    plan = {"seed": 2, "board": {"who_am_i": who_am_i}}
    device_plans.run("cpython", tmp_path, {**device_plans.ALIGNED, **plan, "until": 20})
    info = [[56.5, LONG], *([58.5 + i, SHORT] for i in range(3)), [62.5, LONG]]
    plan |= {"ride": BENDS, "config": {"RECORD": True}, "faults": [["slow_flash", [0.0, 1000.0, erase_s]]]}
    watch.turns.clear()
    record = device_plans.run("cpython", tmp_path, plan | {"presses": info, "until": UNTIL_S})
    blocks = [block for number in sorted(rides(tmp_path)) for block in rides(tmp_path)[number]]
    missing_s = [seconds for block in blocks for seconds in block.missing_s()]
    assert 5 < len(missing_s) <= len(blocks) + 1
    assert missing_s == pytest.approx([erase_s] * len(missing_s), abs=0.025) and min(missing_s) > fifo_s - 0.02
    counts = {int(line[12:]) for _, _, line in record.frames if line.startswith("samples lost")}
    # samples lost after each erase, with up to two losses that are not in the blocks
    losses = [200 * erase_s * k for k in range(len(missing_s) + 3)]
    assert max(counts) > 200 and all(min(abs(count - lost) for lost in losses) < 25 for count in counts)
    gaps = {int(line.split()[0]) for _, _, line in record.frames if " gaps " in line}
    assert gaps and gaps <= set(range(6, len(missing_s) + 3))

    ride = script.Ride([getattr(script, name)(*more) for name, *more in BENDS])
    turns = [turn for turn in watch.turns if turn[0] > FROM_S]
    errors_deg = [(abs(lean - ride.truth(t)[0]), trusted, dt) for t, lean, trusted, dt in turns]
    assert max(error for error, _, _ in errors_deg) > 4  # the gaps cause errors of the lean
    # Where in a bend the gaps are decides how long a wrong lean is shown: 0 to 1.6 s with the sensors of seeds 2 to 7
    assert sum(dt for error, trusted, dt in errors_deg if trusted and error > 5) < 2.0
    assert max(error for error, trusted, _ in errors_deg if trusted) < 12
    assert all(not trusted for _, trusted, dt in errors_deg if dt > 0.3)
    # The lean is trusted again after each gap
    assert sum(dt for _, trusted, dt in errors_deg if not trusted) < 0.5 * (UNTIL_S - FROM_S)


def test_status_shows_the_time_for_a_block(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gc, "mem_free", lambda: 150_000, raising=False)
    with Board(lambda t_s: (0, 1, 0, 0, 0, 0)) as board:
        import kickstand

        board.faults.slow_flash(0.0, 1000.0, 0.4)
        board.run(kickstand.status, 60.0)
    assert re.search("KB free, 40[01] ms to write a block", capsys.readouterr().out)
    assert not list(tmp_path.iterdir())


# The stream over USB


def test_stream_is_base64_lines_with_a_point_per_block(clock):
    from kickstand.rides.usb_stream import RideStream

    stream = RideStream()
    assert (stream.begin(), stream.ready(), stream.room(), stream.stops_interrupts) == (0, True, None, False)
    assert stream.next_length() == stream.next_length() == 512
    with contextlib.redirect_stdout(io.StringIO()) as output:
        stream.write(b"abc" * 50)
        stream.write(b"\0\xff")
        stream.end_block()
        stream.write(b"x")
        stream.end()
        stream.abandon()
    lines = output.getvalue().split("\n")
    assert [a2b_base64(line) for line in (lines[0], lines[1], lines[3])] == [b"abc" * 50, b"\0\xff", b"x"]
    assert lines[2] == "." and lines[4:] == [""] and stream.fault_code(OSError(5)) == "usb-fault"


@pytest.mark.parametrize(("apart_s", "ends"), [(59.0, True), (61.0, False)])
def test_second_slow_print_within_a_minute_ends_the_stream(apart_s, ends, capsys):
    with Board(lambda t_s: (0, 1, 0, 0, 0, 0)) as board:
        from kickstand.rides.usb_stream import RideStream

        for second in (2.0, 2.0 + apart_s):
            board.faults.usb_asleep(second, 0.1)
        failures: list = []

        def main():
            stream = RideStream()
            stream.begin()
            for second in (1.0, 2.01, 3.0, 2.01 + apart_s):
                board.clock.advance(round(1e6 * second) - board.clock.now_us)
                try:
                    stream.write(b"x")
                except OSError:
                    failures.append(second)
            stream.begin()  # a new ride forgets the earlier slow print

        assert board.run(main, 1000.0) == "returned"
    assert bool(failures) is ends


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
            blocks.append(block_reader.parse(data))
            data = b""
        else:
            with contextlib.suppress(binascii.Error):
                data += a2b_base64(line)
    assert [block.sequence for block in blocks] == list(range(len(blocks))) and 15 < len(blocks) < 22
    assert record.ends[-1] == "off"  # the watchdog did not reset the board


def test_refusals_do_not_stall_the_loop_repeatedly():
    """A failure that repeats causes at most one slow print() per minute."""
    with Board(lambda t_s: (0, 1, 0, 0, 0, 0)) as board:

        def main():
            board.clock.advance(100_000)
            begin_us = board.clock.now_us
            for _ in range(600):
                board.clock.advance(100_000)
                errors.report(errors.StoreError("read-back"))
            assert board.clock.now_us - begin_us < 62_000_000

        board.faults.usb_asleep(0.0, 1000.0)
        assert board.run(main, 1000.0) == "returned"
