"""How a board is found, opened, asked and left. The computer's serial port and its clock are simulated."""

import errno
from types import SimpleNamespace

import pytest
from kickstand_tools.common.messages import InputError
from kickstand_tools.deploy import connection, status
from mpremote.transport import TransportError
from serial.tools import list_ports
from support import command

NOTHING = b"(None, None)\r\n", b""  # what a board has noticed whose firmware has not run
PICO_NAME = b"('micropython', '1.26.1', 'Pico')\r\n"


def words(call, *arguments):
    """Return the message of the InputError of this call."""
    with pytest.raises(InputError) as refusal:
        call(*arguments)
    return str(refusal.value)


def connect(failure=None):
    """Open the port P and leave it, with this error in between. Return its name."""
    with connection.connected("P") as (_, name):
        if failure:
            raise failure
        return name


# The port


@pytest.mark.parametrize(
    ("devices", "outcome"),
    [
        *(([("b", vendor, 5), ("c", vendor + 1, 5), ("d", 0x2E8A, 0x000C)], "b") for vendor in connection.VENDORS),
        ([("d", 0x2E8A, 0x000C), ("s", None, None), ("modem", 0x12D1, 1)], "no board found: plug it in"),
        ([], "no board found: plug it in with a USB cable that carries data"),
        ([("b", 0x0403, 1), ("a", 0x2E8A, 5)], "several boards found: a (Raspberry Pi), b (FTDI): name one with"),
    ],
)
def test_only_board_is_found_by_its_vendor(monkeypatch, port, devices, outcome):
    ports = [SimpleNamespace(device=name, vid=vendor, pid=product) for name, vendor, product in devices]
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    if len(outcome) == 1:
        assert connection.find_port() == outcome
    else:
        assert words(connection.find_port).startswith(outcome)
        assert (port.now_s > 0.0) is outcome.startswith("no board")


def test_restarting_board_is_waited_for(monkeypatch, port):
    """With and without its name. After 6 s the command gives up."""
    board = SimpleNamespace(device="P", vid=0x2E8A, pid=5)
    monkeypatch.setattr(list_ports, "comports", lambda: [board] if port.now_s >= 5.0 else [])
    assert connection.find_port() == "P" and port.now_s == pytest.approx(5.0, abs=0.3)
    port.ready_s = port.now_s + 5.0
    for error in (OSError(errno.ENOENT, ""), OSError(errno.EBUSY, "")):
        port.refusal, port.ready_s = error, port.now_s + 5.0
        assert connect() == "P"
        port.ready_s = port.now_s + 9.0
        words(connect)
        assert port.now_s == pytest.approx(port.ready_s - 3.0, abs=0.3)


@pytest.mark.parametrize(
    ("error", "name", "message"),
    [
        (ValueError("odd"), "P", "P is not a port: odd"),
        (OSError(errno.EBUSY, ""), "P", "P is in use: close the other program that has it open; on Linux ModemManager"),
        (OSError(errno.EAGAIN, ""), "P", "P is in use"),
        (OSError("PermissionError(13)"), "P", "P is in use"),
        (OSError(errno.EACCES, ""), "P", "no permission for P: on Linux join the group dialout"),
        (OSError(errno.EPERM, ""), "P", "no permission for P"),
        (OSError(errno.ENOENT, ""), "P", "there is no port P"),
        (OSError("FileNotFoundError(2)"), "P", "there is no port P"),
        (OSError("connection refused"), "socket://x", "nothing listens at socket://x: is kickstand emulate running?"),
        (OSError("connection refused"), "P", "P cannot be opened: connection refused"),
        (OSError("odd"), "socket://x", "socket://x cannot be opened: odd"),
    ],
)
def test_port_that_cannot_be_opened_is_explained(port, error, name, message):
    port.refusal = error
    assert words(status.status, name).startswith(message)


def test_port_that_opens_at_the_second_attempt_is_reported(port):
    assert str(connection.why_closed("P")).startswith("P could not be opened at first, but now it can: try again")
    assert port.closed == 1


# The prompt


def test_starting_board_gets_a_second_chance(port):
    port.deaf = 1
    assert connect() == "P" and port.now_s == pytest.approx(3.0, abs=0.1)
    assert port.opened == [("P", 10)] and port.closed == 1


@pytest.mark.parametrize(
    ("chatter", "message"),
    [
        (b"\0\0>\n", "no MicroPython answers on P"),
        (b"tick\n\n", "P: the board prints 'tick': a program on it does not let go: if that is Kickstand hold"),
        (b"x OSError: 84 Errno 84\n", "P: the board says that its file system is damaged: erase its flash"),
        (b"Guru Meditation Error\n", "MicroPython on the board crashes: erase its flash"),
        (b"rst:0x10 (RTCWDT)\n", "a watchdog of the program on it restarts it again and again"),
        (b"y" * 61 + b"\n", "the board prints '" + "y" * 60 + "': a program"),
    ],
)
def test_board_without_a_prompt_is_explained(port, chatter, message):
    port.chatter = chatter
    assert message in words(connect)


@pytest.mark.parametrize(
    ("failure", "message"),
    [
        (OSError(errno.ENOSPC, ""), "the board at P is full: remove files"),
        *((OSError(number, ""), "P: the board's file system is damaged") for number in (errno.EILSEQ, 84, 52)),
        (OSError(errno.EIO, "x"), "P: connection lost (x): plug the board in again"),
        (OSError(errno.EACCES, "no", "file"), "file: no: check the disk or the file"),
        (TransportError("x"), "P: the board stopped answering: plug it in again"),
    ],
)
def test_error_of_the_connection_has_its_sentence(port, failure, message):
    assert words(connect, failure).startswith(message)
    assert port.closed == 1


# Answers


@pytest.mark.parametrize(
    ("text", "shapes", "fits"),
    [
        (b"3", (int,), True), (b"-1", (int,), False), (b"0", (int,), True), (b"True", (int,), False),
        (b"None", (None,), True), (b"(1, 'a')\r\n", ((int, str),), True), (b"(1,)", ((int, str),), False),
        (b"[1, 'a']", ((int, str),), False), (b"%d" % (2**40 - 1), (int,), True), (b"%d" % 2**40, (int,), False),
        (b"'a'", (int, str), True), (b"\xff", (str,), False), (b"1 +", (int,), False), (b"print()", (str,), False),
    ],
)  # fmt: skip
def test_only_answers_of_the_expected_shape_are_accepted(text, shapes, fits):
    if fits:
        assert repr(connection.literal(text, *shapes)) == text.decode().strip()
    else:
        assert "makes no sense" in words(connection.literal, text, *shapes)


@pytest.mark.parametrize(("wirings", "end"), [(False, b""), (True, status.WIRINGS.encode())])
def test_status_is_printed_and_the_board_restarts(port, wirings, end):
    port.answers = [NOTHING, (PICO_NAME, b""), (b"a \xc2\xb0\r\nb\r\n\r\n", b""), (b"", b"")]
    assert status.status("P", wirings) == "a \u00b0\nb"
    assert port.programs[2] == b"import kickstand\nkickstand.status()" + end and b"machine.reset()" in port.programs[3]
    assert port.now_s == pytest.approx(2.0, abs=0.2) and port.closed == 1  # until the board's port is back


@pytest.mark.parametrize(
    ("answer", "labels"),
    [
        ((b"((9000, 30, ((4, 5, 6), 0.25)), 'odd-up')", b""), ["Sensor odd", "Since start", "Vibration"]),
        ((b"(None, 'odd-up')", b""), ["Sensor odd"]),
        ((b"rubbish", b""), []),
        ((b"", b"MemoryError: "), []),
    ],
)
def test_status_keeps_what_the_firmware_has_noticed(port, answer, labels):
    """A soft reset removes the firmware's modules, so the command asks before it. An older firmware has nothing."""
    port.answers = [answer, (PICO_NAME, b""), (b"noticed (None, None)\r\nSensor none", b""), (b"", b"")]
    *lines, last = status.status("P").splitlines()
    assert [line[:12].strip() for line in lines] == labels and last == "Sensor none"


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (b"x\r\nOSError: [Errno 5] EIO", "P: the board's file system is damaged (OSError: [Errno 5] EIO)"),
        (b"x\r\nRefusal: card: [Errno 5] EIO", "P: card: [Errno 5] EIO"),
        (b"x\r\nSettingsError: wrong: DLPF", "P: wrong: DLPF"),
        (b"ImportError: no module named 'kickstand'", "Kickstand is not on the board at P: install it with"),
        (b"ImportError: no module named 'kickstand.x'", "the firmware on the board at P is of another version"),
        (b"ValueError: x", "the board at P cannot give its status (ValueError: x): kickstand flash brings it"),
        (b" \r\n ", "the board at P cannot give its status (an unknown error)"),
    ],
)
def test_failing_status_is_explained_and_the_board_restarts(port, error, message):
    port.answers = [NOTHING, (PICO_NAME, b""), (b"", error), (b"", b"")]
    assert words(status.status, "P").startswith(message)
    assert b"machine.reset()" in port.programs[-1]


def test_other_python_and_failing_programs_are_refused(port, tmp_path):
    port.answers = [(b"('circuitpython', '9', 'Pico')", b"")]
    command.refused(tmp_path, "check", "--port", "P", words="P runs circuitpython: put MicroPython on the board first")
    port.answers = [(b"", b"Traceback\r\nValueError: x\r\n")]
    assert words(status.status, "P") == "P: the board reports ValueError: x: try again"
    port.answers = [(b"", b"OSError: [Errno 84]\r\nOSError: [Errno 5] EIO\r\n")]
    assert words(status.status, "P").startswith("P: the board's file system is damaged (OSError: [Errno 5] EIO)")


# The lines of a running program
