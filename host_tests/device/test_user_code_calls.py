"""Which functions of user.py are called, what they get, and when one is disabled. UserCode runs without an app."""

import sys
from types import SimpleNamespace

import pytest
from support.board_access import on_board


@pytest.fixture
def owners(tmp_path, monkeypatch, capsys):
    """Return owners(source, use): it runs use(UserCode of this user.py) on a board, and returns what use() returns."""

    def run(source, use):
        (tmp_path / "user.py").write_text(source)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        found = []

        def program(board):
            from kickstand.user_code import UserCode

            app = SimpleNamespace(name="the app", meter=SimpleNamespace(lean_deg=-12.5))
            found.append(use(UserCode(app)))

        try:
            assert on_board(program, 60.0)[0] == "returned"
        finally:
            sys.modules.pop("user", None)
        return found[0]

    return run


def problems(user):
    """Return the code and the values of each notice that was not shown yet."""
    found = []
    while notice := user.take_problem():
        found.append((notice.code, *notice.values))
    return found


def test_each_function_gets_its_arguments(owners):
    source = (
        "got = []\ndef setup(app):\n    got.append(('setup', app.name))\n"
        "def on_lean(lean_deg, trusted, meter):\n    got.append((lean_deg, trusted, meter.lean_deg))\n"
        "def on_press(event):\n    got.append(event)\n"
    )

    def use(user):
        user.lean(True)
        user.lean(False)
        user.press(2)
        return sys.modules["user"].got, user.pages, problems(user)

    got, pages, said = owners(source, use)
    assert got == [("setup", "the app"), (-12.5, True, -12.5), (-12.5, False, -12.5), 2]
    assert pages == [] and said == []


def test_pages_are_in_alphabetical_order_and_text_or_numbers(owners):
    source = (
        "pages = 3\npage_size = 'no function'\ndef page_b(app):\n    return 1.5, b'two'\n"
        "def page(app):\n    return app.name, ''\ndef page_a(app):\n    return ['a', 'b', None]\n"
        "def other(app):\n    1 / 0\n"
    )
    shown, said = owners(source, lambda user: ([page() for page in user.pages], problems(user)))
    assert shown == [("the app", "", None), ("a", "b", None), ("1.5", b"two", None)]
    assert said == []


def test_a_picture_is_drawn_with_its_values_and_stays_the_same_function(owners):
    source = "def draw(canvas, a, b):\n    canvas.append((a, b))\ndef page(app):\n    return 'a', 'b', (draw, 4, 5)\n"

    def use(user):
        (page,) = user.pages
        first, second, canvas = page()[2], page()[2], []
        first[0](canvas, *first[1:])
        return first == second, canvas, problems(user)

    assert owners(source, use) == (True, [(4, 5)], [])


def test_a_picture_that_fails_disables_its_page(owners):
    source = (
        "def draw(canvas):\n    1 / 0\ndef page(app):\n    return 'a', 'b', (draw,)\n"
        "def page_c(app):\n    return 'c', 'd'\n"
    )

    def use(user):
        first, other = user.pages
        draw, *values = first()[2]
        draw([], *values)
        return first(), other(), problems(user)

    page, other, said = owners(source, use)
    assert page == ("user.py page", "left out") and other == ("c", "d", None)
    assert said == [("user-failed", "picture", "ZeroDivisionError")]


@pytest.mark.parametrize("body", ["return 'one line'[:1],", "return 5", "return None"])
def test_a_page_without_two_lines_is_left_out(owners, body):
    def use(user):
        (page,) = user.pages
        return page(), page(), problems(user)

    first, second, said = owners(f"def page(app):\n    {body}\n", use)
    assert (first, second) == (("user.py page", "not two lines"), ("user.py page", "left out"))
    assert said == [("user-failed", "page", "not two lines")]


SLEEPS = "import time\ndef on_press(ms):\n    time.sleep_ms(ms)\n"


@pytest.mark.parametrize(
    ("calls_ms", "said"),
    [
        ([50] * 9, []),
        ([52], [("user-slow", 52)]),
        ([52] * 4 + [10] + [60] * 4, [("user-slow", 52)]),
        ([52] * 5, [("user-slow", 52), ("user-failed", "52 ms")]),
        ([52] * 7, [("user-slow", 52), ("user-failed", "52 ms")]),
        ([52, 10, 52, 52, 52, 52, 60], [("user-slow", 52), ("user-failed", "60 ms")]),
        ([300], [("user-slow", 300)]),
        ([302], [("user-slow", 302), ("user-failed", "302 ms")]),
    ],
)
def test_slow_calls_are_reported_once_and_too_many_disable(owners, calls_ms, said):
    """A call over 50 ms is slow. Five slow calls in a row, or one over 300 ms, disable the function."""

    def use(user):
        for ms in calls_ms:
            user.press(ms)
        return problems(user)

    assert owners(SLEEPS, use) == [(code, "on_press", value) for code, value in said]


def test_the_import_and_setup_may_take_any_time(owners):
    assert owners("import time\ntime.sleep_ms(900)\ndef setup(app):\n    time.sleep_ms(900)\n", problems) == []


@pytest.mark.parametrize(("free", "kept"), [(20_000, True), (19_999, False)])
def test_it_is_disabled_with_less_than_20_kb_of_heap(owners, free, kept, monkeypatch):
    def use(user):
        from kickstand import user_code

        monkeypatch.setattr(user_code.gc, "mem_free", lambda: free, raising=False)
        user.check_memory()
        user.check_memory()
        return [page() for page in user.pages], problems(user), "user" in sys.modules

    shown, said, loaded = owners("def page(app):\n    return 'a', 'b'\n", use)
    if kept:
        assert (shown, said, loaded) == ([("a", "b", None)], [], True)
    else:
        assert (shown, said, loaded) == ([("user.py page", "left out")], [("user-memory", "memory")], False)


def test_a_memory_error_disables_every_function(owners):
    def use(user):
        user.press(1)
        user.lean(True)
        return problems(user)

    source = "def on_press(event):\n    raise MemoryError\ndef on_lean(*a):\n    1 / 0\n"
    assert owners(source, use) == [("user-memory", "on_press")]


def test_notices_come_in_their_order(owners):
    def use(user):
        user.press(1)
        user.lean(True)
        return problems(user)

    assert owners("def on_press(event):\n    1 / 0\ndef on_lean(*a):\n    {}['x']\n", use) == [
        ("user-failed", "on_press", "ZeroDivisionError"), ("user-failed", "on_lean", "KeyError"),
    ]  # fmt: skip
