"""The power is cut at every flash operation, on the emulated boards' own file system. Calibrations and rides
survive."""

import ast
import re
import signal
from itertools import pairwise

import pytest
from kickstand.calibration.store import Store
from kickstand_sim.simulation.scripted.script import Ride, accelerate, turn, wait
from kickstand_tools.logs.reader import read_log
from kickstand_tools.rides import ride_log
from support import command, emulated_port
from support.emulated import PART, calibrated, esp32, firmware, leaning, modules, pico

pytestmark = pytest.mark.chip

RIDE = Ride([wait(1.0), accelerate(15.0, 2.0), turn(-30.0, 3.0), turn(35.0, 3.0)])
SAVES = 16  # littlefs appends one page per save, and every fifteenth save erases a new block
SHARES = (0.05, 0.5, 0.95)  # the share of a flash operation that is done when the power is cut

# Each save stores another gyro bias about x, so a test can tell the calibrations apart.
_STORE = """
from kickstand.calibration.store import Store
def bias():
    return Store(0x68, 8).load().gyro_bias[0]
def save(value):
    store = Store(0x68, 8)
    calibration = store.load()
    calibration.gyro_bias[0] = value
    store.save(calibration)
"""
_SAVE_ZERO = _STORE + "save(0)\nsave(0)\n"

# Write the samples of a simulated ride as fast as possible.
_FEED = """
import random
from kickstand.rides.recorder import Recorder
from kickstand.rides.ride_files import RideFiles
from kickstand.calibration.parameters import Calibration
class Settings:
    SD_SPI = None
class Chip:
    who_am_i, accel_range_g, accel_lsb_per_g, gyro_lsb_per_dps = 0x68, 8, 4096, 65.5
    gyro_delay_s = 0.0048
    counts = [0] * 7
    def temperature_c(self, counts):
        return 25.0
recorder = Recorder(RideFiles(Settings), 200, [])
def feed(samples):
    sums = [0] * 7
    for _ in range(samples):
        for i in range(7):
            sums[i] = random.getrandbits(12)
        recorder.add(sums, 2, 10000)
        recorder.tick()
"""
_START = "recorder.start(Chip(), Calibration())\n"
SAMPLES = 700  # over three blocks of a ride


def torn(old, new, share):
    """Return the flash after the power was cut in an operation. share: the share of the operation that was done."""
    first = next(i for i in range(0, len(old), 256) if old[i : i + 256] != new[i : i + 256])
    last = next(i for i in range(len(old), 0, -256) if old[i - 256 : i] != new[i - 256 : i])
    while old[first] == new[first]:
        first += 1
    cut = first + max(1, round((last - first) * share))
    return old[:first] + new[first:cut] + old[cut:]


def states_of_flash(device, code):
    """Return the flash before the code runs and after each of its flash operations."""
    states = []
    if device.NAME != "ESP32":
        device.chip.flash.before_operation = lambda: states.append(device.file_system)
        device.exec(code, 30.0)
        device.chip.flash.before_operation = None
        return [*states, device.file_system]
    device.exec("pass")
    device.send(code.encode() + b"\x04")
    del device.said[:]
    states.append(device.file_system)
    while not device.said.endswith(b"\x04>"):
        device.run(20e-6)  # the flash of QEMU takes no time, but the program needs longer between two writes
        if device.file_system != states[-1]:
            states.append(device.file_system)
    return states


def stored_bias(system, image, directory):
    """Return the gyro bias that the firmware loads from this flash."""
    for name, content in system.read(image).items():
        if name.endswith(".cal"):
            (directory / name).write_bytes(content)
    return Store(0x68, 8, str(directory)).load().gyro_bias[0]


def rides(files):
    """Return {ride: its blocks in order}. Fails if a file contains anything but blocks, the last one perhaps cut."""
    blocks_of_ride = {}
    for name in sorted(files):
        if name.startswith("rides/"):
            blocks, problems = ride_log.read(files[name])
            assert set(problems) <= {ride_log.CUT_SHORT}
            for block in blocks:
                blocks_of_ride.setdefault(block.ride, []).append(block)
    return blocks_of_ride


@pytest.mark.long
def test_a_save_cut_anywhere_leaves_the_old_or_the_new(at_prompt, tmp_path):
    """The power is cut before, within and after each operation of SAVES saves."""
    at_prompt.exec(_SAVE_ZERO)
    operations = 0
    for value in range(1, SAVES + 1):
        states = states_of_flash(at_prompt, f"save({value})")
        operations += len(states) - 1
        halves = [torn(*pair, share) for pair in pairwise(states) for share in SHARES]
        biases = [stored_bias(at_prompt.FLASH, state, tmp_path) for state in states + halves]
        assert set(biases) == {value - 1, value}
        assert biases[0] == value - 1
        assert biases[len(states) - 1] == value
    assert operations >= SAVES + 2  # the saves include the erase of at least one block


@pytest.mark.esp32
@pytest.mark.long
def test_a_save_cut_anywhere_on_an_esp32(tmp_path):
    with esp32(leaning(20.0), modules("esp32") | calibrated()) as device:
        device.exec(_SAVE_ZERO)
        states = states_of_flash(device, "save(1)")
        biases = [stored_bias(device.FLASH, state, tmp_path) for state in states]
        assert set(biases) == {0, 1} and biases == sorted(biases)
        device.power_off()
        device.file_system = states[len(states) // 2]
        device.power_on()
        device.run(1.6)
        device.exec(_STORE + "save(9)")
        assert float(device.exec("print(bias())")) == 9.0


@pytest.mark.parametrize("operation", [8, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 9, 10))])
def test_board_starts_and_saves_after_a_power_cut(at_prompt, operation):
    """The eighth operation is an erase."""
    at_prompt.exec(_SAVE_ZERO)
    at_prompt.chip.flash.cut_power(operation, 0.5)
    del at_prompt.said[:]
    at_prompt.send(b"for i in range(1, 20):\n    save(i)\n    print(i)\n\x04")
    at_prompt.run(2.0)
    assert not at_prompt.powered
    saved = int((at_prompt.said.decode().split() or ["0"])[-1].removeprefix("OK") or 0)
    at_prompt.power_on()
    assert float(at_prompt.exec(_STORE + "print(bias())")) in (saved, saved + 1)
    assert float(at_prompt.exec("save(40)\nprint(bias())")) == 40


@pytest.mark.long
def test_a_ride_cut_anywhere_loses_its_last_block_at_most(at_prompt):
    """The calibration always survives."""
    at_prompt.exec(_FEED)
    states = states_of_flash(at_prompt, _START + f"feed({SAMPLES})\nrecorder.stop()")
    complete = 0
    for old, new in pairwise(states):
        for state in (old, *(torn(old, new, share) for share in SHARES)) if old != new else ():
            files = at_prompt.FLASH.read(state)
            assert files.items() >= calibrated().items()
            sequences = [block.sequence for block in rides(files).get(1, [])]
            assert sequences == list(range(len(sequences)))
            assert len(sequences) >= complete - 1
            complete = max(complete, len(sequences))
    assert len(states) > 40
    assert complete >= 2


@pytest.mark.long
@pytest.mark.parametrize("operation", [2, 37])
def test_board_records_again_after_a_power_cut(at_prompt, operation):
    at_prompt.exec(_FEED)
    at_prompt.chip.flash.cut_power(operation, 0.5)
    at_prompt.send(f"{_START}feed({2 * SAMPLES})\x04".encode())
    at_prompt.run(6.0)
    assert not at_prompt.powered
    at_prompt.power_on()
    at_prompt.exec(f"{_FEED}{_START}feed({SAMPLES})\nrecorder.stop()\n", 20.0)
    assert len([*rides(at_prompt.files()).values()][-1]) >= 2


@pytest.mark.long
def test_pull_and_record_through_mpremote(tmp_path, monkeypatch):
    """A ride ends and is pulled, then a log is streamed. Both logs can be replayed."""
    files = firmware() | calibrated() | {"config.py": b"RECORD = True\n"}
    with pico(PART.world(RIDE.motion), files) as device:
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

        live = tmp_path / "live.csv"
        device.run(2.0)
        ends.append(device.time_s + 5.0)
        result = command.works("record", "--port", emulated_port.NAME, "--out", live)
        assert result.err == ""
        assert re.search(r"written: .*live\.csv, [\d.]+ s, \d+ readings", result.out)
    for path in (pulled, live):
        calibration = ride_log.calibration_path(path)
        command.works("replay", path, "--calibration", calibration, "--out", tmp_path / "lean.csv")


_LONG_RIDE = """
import gc
chip, sums = Chip(), [0] * 7
recorder.start(chip, Calibration())
for _ in range(4):
    recorder.add(sums, 2, 500_000_000)
gc.collect()
free = gc.mem_free()
for _ in range(20):
    recorder.add(sums, 2, 10000)
print(free - gc.mem_free(), recorder.seconds())
"""


@pytest.mark.long
def test_recording_takes_no_heap_after_18_minutes(at_prompt):
    """Integers of over 30 bits would take 16 bytes of heap in each pass of the loop."""
    at_prompt.exec("import gc\ngc.disable()")
    heap, seconds = map(int, at_prompt.exec(_FEED + _LONG_RIDE, 20.0).split())
    assert seconds == 2000
    assert heap < 200


# Run the unchanged app with recording for 6 s, and note the lean that each pass of its loop has for user.py.
_USER = b"""
leans = []
def on_lean(lean_deg, trusted, meter):
    leans.append(meter.lean_deg)
"""


@pytest.mark.long
def test_recording_loses_no_sample_and_marks_the_display(at_prompt):
    from kickstand_emulator.bench import SampleCount

    begin_s, world = at_prompt.time_s, PART.world(RIDE.motion)
    at_prompt.board.sensor.world = lambda t_s: world(t_s - begin_s)
    at_prompt.power_off()
    at_prompt.put_files(firmware() | calibrated() | {"/config.py": b"RECORD = True\n", "/user.py": _USER})
    at_prompt.power_on()
    at_prompt.run(2.0)
    samples = SampleCount(at_prompt.board.sensor)
    samples.begin()
    texts = set()
    for _ in range(40):
        at_prompt.run(0.1)
        texts.add(at_prompt.lcd()[0])
    assert samples.lost() == 0
    assert len(texts) > 3
    assert all(text.endswith("*") for text in texts if "°" in text)
    leans = ast.literal_eval(at_prompt.exec("import user\nprint(user.leans)", 20.0))
    assert max(leans) - min(leans) > 10
    assert sum(len(block.turns) for block in rides(at_prompt.files())[1]) > 200
