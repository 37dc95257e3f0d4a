"""The recorder on the emulated Pico. The emulated Pico has littlefs, a flash that stalls the processor, and 32-bit
floats. The tests also cut the power and use mpremote."""

import ast
import re
import signal
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from kickstand_tools.calibration.file import read_calibration
from kickstand_tools.logs.reader import read_blocks, read_log
from kickstand_tools.replay import replay_engine
from kickstand_tools.rides import block_reader, ride_log
from kickstand_tools.simulation.scripted.script import Ride, accelerate, turn, wait
from kickstand_workshop.bench.sample_count import SampleCount
from support import command, emulated_port
from support.emulated import CHIPS, PART, calibrated, firmware
from test_chip_power_cut import torn

pytestmark = pytest.mark.chip

RIDE = Ride([wait(1.0), accelerate(15.0, 2.0), turn(-30.0, 3.0), turn(35.0, 3.0)])

# Run the unchanged app for some seconds and note the lean at each pass of its loop. Then end the ride.
_RUN = """
from array import array
from time import ticks_add, ticks_diff, ticks_ms
from kickstand import app, devices, settings
from kickstand.lean.meter import LeanMeter
class Config:
    RECORD = True
    WATCHDOG = False
class Done(Exception):
    pass
leans = array("f", bytes(4 * 2000))
count = 0
until_ms = ticks_add(ticks_ms(), SECONDS * 1000)
update = LeanMeter.update_sum
def noted(self, *arguments):
    global count
    if ticks_diff(ticks_ms(), until_ms) > 0:
        raise KeyboardInterrupt
    update(self, *arguments)
    leans[count] = self.lean_deg
    count += 1
LeanMeter.update_sum = noted
chosen = settings.Settings(Config)
try:
    app.App(chosen, devices.open_lcd(chosen), devices.open_sensor(chosen)).run()
except KeyboardInterrupt:
    pass
print(list(leans[:count]))
"""

# Write the samples of a simulated ride as fast as possible.
FEED = """
import random
from kickstand.rides.recorder import Recorder
from kickstand.rides.flash_ring import RideRing
from kickstand.calibration.parameters import Calibration
class Settings:
    SD_SPI = None
class Chip:
    who_am_i, accel_range_g, accel_lsb_per_g, gyro_lsb_per_dps = 0x68, 8, 4096, 65.5
    gyro_delay_s = 0.0048
    counts = [0] * 7
    def temperature_c(self, counts):
        return 25.0
recorder = Recorder(RideRing(Settings), 200)
def feed(blocks):
    sums = [0] * 7
    while recorder.active and recorder._sequence <= blocks:
        for i in range(7):
            sums[i] = random.getrandbits(12)
        recorder.add(sums, 2, 10000)
        recorder.tick()
"""


def rides(files):
    """Return the blocks of each ride in order. Fails if a file contains anything but whole blocks."""
    found = {}
    for name in sorted(files):
        if name.startswith("rides/"):
            blocks, problems = block_reader.read(files[name])
            assert set(problems) <= {block_reader.CUT_SHORT}
            for block in blocks:
                found.setdefault(block.ride, []).append(block)
    return found


@pytest.mark.nightly  # host_tests/rides/test_recorder.py and test_slow_flash.py have similar tests
def test_a_recorded_ride_replays_as_it_was_shown(at_prompt, tmp_path):
    """No sample is lost during the recording, and the display keeps working."""
    begun_s, world = at_prompt.time_s, PART.world(RIDE.motion)
    at_prompt.board.sensor.world = lambda t_s: world(t_s - begun_s)
    samples = SampleCount(at_prompt.board.sensor)
    shown = set()
    at_prompt.board.at(begun_s + 2.0, samples.begin)
    lost = []
    at_prompt.board.at(begun_s + 4.7, lambda: lost.append(samples.lost()))
    for i in range(27):
        at_prompt.board.at(begun_s + 2.0 + i / 10, lambda: shown.add(tuple(at_prompt.lcd())))
    leans = ast.literal_eval(at_prompt.exec(_RUN.replace("SECONDS", "6"), 20.0))
    found = rides(at_prompt.files())
    assert lost == [0]
    assert len(shown) > 10
    assert all(lines[0].endswith("*") for lines in shown if "°" in lines[0])
    assert list(found) == [1]
    assert sum(len(block.turns) for block in found[1]) == len(leans)
    assert len(found[1]) >= 2
    cal = ride_log.write(tmp_path / "ride.csv.gz", found[1])
    engine = replay_engine.Replay(read_calibration(cal).to_firmware())
    rows = [row for block in read_blocks(tmp_path / "ride.csv.gz") for row in block.rows()]
    assert max(abs(engine.step(*row)[0] - lean) for row, lean in zip(rows, leans, strict=True)) < 0.05
    assert max(leans) - min(leans) > 10


@pytest.mark.nightly  # test_chip_power_cut.py has a similar test, which cuts each write of a calibration
def test_power_cut_loses_only_the_last_block(at_prompt):
    """The power is cut before, during and after each flash operation. The calibration always survives."""
    at_prompt.exec(FEED)
    states = []
    at_prompt.chip.flash.before_operation = lambda: states.append((at_prompt.file_system, None))
    at_prompt.exec("recorder.start(Chip(), Calibration())")
    written = 0
    for blocks in range(1, 5):
        at_prompt.exec(f"feed({blocks})")
        states.append((at_prompt.file_system, written))
        written = blocks
    at_prompt.exec("recorder.stop()")
    states.append((at_prompt.file_system, 4))
    kept = calibrated()
    at_least = 0
    checked = 0
    for (before, known), (after, _) in pairwise(states):
        at_least = max(at_least, known or 0)
        if before == after:
            continue
        for state in (before, *(torn(before, after, share) for share in (0.05, 0.5, 0.95))):
            files = at_prompt.FLASH.read(state)
            assert files.items() >= kept.items()
            sequences = [block.sequence for block in rides(files).get(1, [])]
            assert sequences == list(range(len(sequences)))
            assert len(sequences) >= at_least - 1
            checked += 1
    assert checked > 4 * 60
    assert len(rides(at_prompt.FLASH.read(states[-1][0]))[1]) >= 4


@pytest.mark.parametrize("operation", [2, pytest.param(37, marks=pytest.mark.nightly)])
def test_board_records_again_after_a_power_cut(at_prompt, operation):
    at_prompt.exec(FEED)
    at_prompt.chip.flash.cut_power(operation, 0.5)
    at_prompt.send(b"recorder.start(Chip(), Calibration())\nfeed(6)\x04")
    at_prompt.run(6.0)
    assert not at_prompt.powered
    at_prompt.power_on()
    at_prompt.exec(FEED + "recorder.start(Chip(), Calibration())\nfeed(2)\nrecorder.stop()\n", 20.0)
    found = rides(at_prompt.files())
    assert [len(blocks) for blocks in found.values()][-1] >= 2


@pytest.mark.nightly
@pytest.mark.parametrize("chip", ["pico", pytest.param("esp32", marks=pytest.mark.esp32)])
def test_pull_and_record_through_mpremote(tmp_path, monkeypatch, chip):
    """A ride ends and is pulled, then a log is streamed. The ESP32 also has a GPS receiver. The logs of the ride and of
    the stream can be replayed."""
    config = "RECORD = True\n" + {"pico": "", "esp32": 'SPEED = "gps"\n'}[chip]
    files = firmware(chip) | calibrated() | {"config.py": config.encode()}
    board: Any = CHIPS[chip](PART.world(RIDE.motion), files)
    with board as device:
        if chip == "esp32":
            device.fit_gps(lambda t_s: RIDE.truth(t_s)[1])
        ends = []  # times in seconds at which the user presses Ctrl-C

        def ctrl_c():
            if ends and device.time_s > ends[0]:
                ends.clear()
                signal.raise_signal(signal.SIGINT)

        emulated_port.plug_in(monkeypatch, device, ctrl_c)
        device.run(6.5)
        result = command.works("pull", "--port", emulated_port.NAME, "--out", tmp_path, "--delete")
        assert result.err == ""
        assert "deleted from the board: ride 1" in result.out
        pulled = next(tmp_path.glob("ride-00001-*.csv.gz"))
        log = read_log(pulled)
        assert len(log.time_us) > 150
        assert np.isfinite(log.lat_deg).any() == (chip == "esp32")

        live = tmp_path / "live.csv"
        device.run(2.0)  # while an ESP32 starts it ignores its console, and the next attempt would be 10 s later
        ends.append(device.time_s + 5.0)
        result = command.works("record", "--port", emulated_port.NAME, "--out", live)
        assert result.err == ""
        assert result.out.startswith("recording from ")
        assert re.search(r"written: .*live\.csv, [\d.]+ s, \d+ readings", result.out)
    for path in (pulled, live):
        cal = ride_log.calibration_path(path)
        command.works("replay", path, "--calibration", cal, "--out", tmp_path / "lean.csv")
