"""What the board prints on its USB console: the sentences of refusals, and the pause after a slow print."""

import pytest
from kickstand import console
from kickstand.errors import CardError, Notice, SettingsError
from support.board_access import on_board


@pytest.mark.parametrize(
    ("refusal", "said"),
    [
        (Notice("gyro-scale", "z", -31.4), "about z with -31 %: another sensor"),
        (Notice("gyro-tilt", 11.26, 7.0), "between the poses are 11.3 degrees, but by the gyro 7.0:"),
        (Notice("unknown-chip", 0x0C), "WHO_AM_I 0x0c: set ACCEPT_WHO_AM_I = 0x0c in"),
        (Notice("no-chip", 0, 0x69), "the device at 0x69 is not an MPU6050 (it reads 0x00)"),
        (
            SettingsError("aliasing", "DLPF", 2, 100, 3),
            "DLPF = 2 lets vibration alias at SAMPLE_HZ = 100: set DLPF = 3",
        ),
        (SettingsError("not-allowed", "SIDE", "up", "left"), "config.py: SIDE = 'up', but it must be left"),
        (CardError("card-fault", "EIO"), "recording stopped: EIO"),
    ],
)
def test_a_sentence_has_the_values_of_its_refusal(refusal, said):
    sentence = console.sentence(refusal)
    assert said in sentence and "\n" not in sentence and "|" not in sentence


@pytest.fixture
def printing(monkeypatch):
    """Return a function that calls use(takes_ms) on a board, and returns the result of use() and the printed texts.

    use() sets takes_ms[0], the time in ms that one print takes.
    """

    def run(use):
        printed, takes_ms, found = [], [0], []

        def program(board):
            from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

            def slow_print(text, end="\n"):
                sleep_ms(takes_ms[0])
                printed.append(text + end)

            monkeypatch.setattr(console, "print", slow_print, raising=False)
            found.append(use(takes_ms))

        monkeypatch.setattr(console, "_slow_ms", None)
        assert on_board(program, 1000.0)[0] == "returned"
        return found[0], printed

    return run


@pytest.mark.parametrize(("ms", "slow"), [(0, False), (98, False), (100, True), (101, True)])
def test_a_print_of_100_ms_is_slow(printing, ms, slow):
    def use(takes_ms):
        takes_ms[0] = ms
        return console.say("text", "."), console.say("text")

    assert printing(use) == ((slow, slow), ["text.", "text\n"])


@pytest.mark.parametrize(("pause_s", "printed_again"), [(0, False), (59.8, False), (59.86, True)])
def test_no_refusal_is_printed_for_a_minute_after_a_slow_print(printing, pause_s, printed_again):
    """The minute counts from the beginning of the slow print, which takes 150 ms."""

    def use(takes_ms):
        from time import sleep_ms  # pyright: ignore[reportAttributeAccessIssue]

        takes_ms[0] = 150
        console.tell(Notice("no-memory", "first"))
        takes_ms[0] = 0
        sleep_ms(round(1000 * pause_s))
        console.tell(Notice("no-memory", "heap"))

    _, printed = printing(use)
    assert len(printed) == 1 + printed_again and (not printed_again or "heap" in printed[1])


def test_quick_prints_never_pause(printing):
    def use(takes_ms):
        for value in "abc":
            console.tell(Notice("no-memory", value))

    assert ["(a)" in printing(use)[1][0], len(printing(use)[1])] == [True, 3]
