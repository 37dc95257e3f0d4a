"""Breaks logs in many ways. The same number always breaks a log in the same way."""

import contextlib
import functools
import gzip
import random
from collections.abc import Callable

Rows = list[list[bytes]]  # for each line a list of its cells

WORDS = (
    *("nan", "NaN", "inf", "-inf", "1e308", "-1e308", "1e999", "1e-320", "5e15", "-0", "+-1", "1_0", "0x10", "1e", "."),
    *("", " ", "--", "null", '"', '"0', "0\x00", "\u0663", "\uff11", "\u00e9", "1,5", "1;5", "1 5", "9" * 400, "'"),
)
SIZES = (0.0, 1e-3, 1e-6, 9.80665, 57.29578, 1000.0, 1e6, 1e12, -1.0)


def _of_lines(way):
    """Turn a function that breaks a list of lines into a function that breaks a text."""

    @functools.wraps(way)
    def of_text(text: bytes, chance: random.Random) -> bytes:
        lines = text.split(b"\n")
        return b"\n".join(way(lines, chance) or lines)

    return of_text


def _of_cells(way):
    """Turn a function that changes lists of cells in place into a function that breaks a text."""

    @functools.wraps(way)
    def of_text(text: bytes, chance: random.Random) -> bytes:
        rows = [line.split(b",") for line in text.split(b"\n")]
        way(rows, chance)
        return b"\n".join(b",".join(row) for row in rows)

    return of_text


def _renumber(rows: Rows, place: int, change: Callable[[float], bytes]) -> None:
    for row in rows:
        with contextlib.suppress(ValueError, IndexError):
            row[place] = change(float(row[place]))


def flip_bytes(text: bytes, chance: random.Random) -> bytes:
    changed = bytearray(text)
    for _ in range(chance.choice((1, 3, 30))):
        if changed:
            changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def cut_end(text: bytes, chance: random.Random) -> bytes:
    return text[: chance.randrange(len(text) + 1)]


def cut_a_piece(text: bytes, chance: random.Random) -> bytes:
    begin = chance.randrange(len(text) + 1)
    return text[:begin] + text[begin + chance.choice((1, 5, 50, 2000)) :]


@_of_lines
def double_lines(lines: list[bytes], chance: random.Random) -> list[bytes]:
    index = chance.randrange(len(lines))
    many = chance.choice((1, 1, 5, 60))
    return lines[:index] + lines[index : index + 1] * many + lines[index:]


@_of_lines
def exchange_lines(lines: list[bytes], chance: random.Random) -> None:
    a, b = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]


@_of_lines
def shuffle_lines(lines: list[bytes], chance: random.Random) -> list[bytes]:
    body = lines[1:]
    chance.shuffle(body)
    return lines[:1] + body


@_of_cells
def lose_a_column(rows: Rows, chance: random.Random) -> None:
    column = chance.randrange(max(1, len(rows[0])))
    for row in rows:
        del row[column : column + 1]


@_of_cells
def exchange_columns(rows: Rows, chance: random.Random) -> None:
    width = max(1, len(rows[0]))
    a, b = chance.randrange(width), chance.randrange(width)
    header = chance.random() < 0.5  # sometimes the names in the header are exchanged, too
    for row in rows[0 if header else 1 :]:
        if len(row) > max(a, b):
            row[a], row[b] = row[b], row[a]


@_of_cells
def rename_a_column(rows: Rows, chance: random.Random) -> None:
    rows[0][chance.randrange(len(rows[0]))] = chance.choice((b"", b"ax_g", b"speed_mps", b"time", b"lean_deg", b'"'))


@_of_cells
def put_a_word(rows: Rows, chance: random.Random) -> None:
    for _ in range(chance.choice((1, 1, 4, 100))):
        row = chance.choice(rows)
        row[chance.randrange(len(row))] = chance.choice(WORDS).encode()


@_of_cells
def scale_a_column(rows: Rows, chance: random.Random) -> None:
    size = chance.choice(SIZES)
    places = chance.choice(([0], [1, 2, 3], [4, 5, 6], [7], [1], [5]))
    begin = chance.choice((1, len(rows) // 2))
    for column in places:
        _renumber(rows[begin:], column, lambda value: b"%.9g" % (value * size))


@_of_cells
def shift_the_time(rows: Rows, chance: random.Random) -> None:
    by = chance.choice((-1.0, -1e-3, 1e-7, 0.3, 60.0, 1e6, 1.7e9, 9.9e9))
    begin = chance.randrange(1, max(2, len(rows)))
    _renumber(rows[begin:], 0, lambda value: b"%.6f" % (value + by))


@_of_cells
def round_the_time(rows: Rows, chance: random.Random) -> None:
    digits = chance.choice((0, 1, 2))
    _renumber(rows[1:], 0, lambda value: b"%.*f" % (digits, value))


@_of_cells
def go_wild(rows: Rows, chance: random.Random) -> None:
    """Replace readings by values up to the limits of the widest ranges."""
    begin = chance.choice((1, len(rows) // 3))
    g, dps = chance.choice(((19.0, 2400.0), (4.0, 2400.0), (19.0, 10.0)))
    for row in rows[begin : begin + chance.choice((1, 20, 1000))]:
        if len(row) > 6:
            row[1:7] = [b"%.4f" % chance.uniform(-limit, limit) for limit in (g, g, g, dps, dps, dps)]


@_of_cells
def freeze(rows: Rows, chance: random.Random) -> None:
    begin = chance.randrange(len(rows))
    for row in rows[begin : begin + chance.choice((10, 60, 10_000))]:
        row[1:] = rows[begin][1:]


def other_separators(text: bytes, chance: random.Random) -> bytes:
    text = text.replace(b".", b",") if chance.random() < 0.3 else text
    return text.replace(b",", chance.choice((b";", b"\t", b" ", b", ", b"|", b",,")))


def other_lines(text: bytes, chance: random.Random) -> bytes:
    return text.replace(b"\n", chance.choice((b"\r", b"\r\n", b"\n\n", b"\n\r", b"\x0b", b" \n", b"\n \n", b",\n")))


def other_encoding(text: bytes, chance: random.Random) -> bytes:
    name = chance.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "cp037", "utf-7"))
    return text.decode("latin-1").encode(name, "replace")


def put_nul_bytes(text: bytes, chance: random.Random) -> bytes:
    offset = chance.choice((0, len(text), chance.randrange(len(text) + 1)))
    return text[:offset] + bytes(chance.choice((1, 7, 5000))) + (text[offset:] if chance.random() < 0.5 else b"")


def quote(text: bytes, chance: random.Random) -> bytes:
    offset = chance.randrange(len(text) + 1)
    return text[:offset] + b'"' + text[offset:]


@_of_lines
def a_long_line(lines: list[bytes], chance: random.Random) -> None:
    lines[chance.randrange(len(lines))] += chance.choice((b"1", b",", b"x", b" ")) * 200_000


def nearly_nothing(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    return chance.choice((b"", b"\n", b" ", lines[0], lines[0] + b"\n", b"\n".join(lines[:2]), b"\n".join(lines[:3])))


def pack(text: bytes, chance: random.Random) -> bytes:
    """Start the content with the first bytes of a gzip file, also if the file's name does not end in .gz."""
    return gzip.compress(text, 1, mtime=0)


WAYS = [
    *(flip_bytes, cut_end, cut_a_piece, double_lines, exchange_lines, shuffle_lines, lose_a_column, exchange_columns),
    *(rename_a_column, put_a_word, scale_a_column, shift_the_time, round_the_time, freeze, go_wild),
    *(other_separators, other_lines, other_encoding, put_nul_bytes, quote, a_long_line, nearly_nothing, pack),
]


def broken(bases: list[bytes], number: int) -> tuple[str, bytes, str]:
    """Return the name and content of a broken file, and the one to three ways in which it was broken."""
    chance = random.Random(number)
    text = chance.choice(bases)
    ways = [WAYS[number % len(WAYS)], *chance.choices(WAYS, k=chance.choice((0, 0, 1, 2)))]
    for way in ways:
        text = way(text, chance)
    name = "RIDE.csv"
    if chance.random() < 0.2:
        name, text = "RIDE.csv.gz", gzip.compress(text, 1, mtime=0)
        if chance.random() < 0.7:
            second = chance.choice((flip_bytes, cut_end, put_nul_bytes, cut_a_piece))
            ways.append(second)
            text = second(text, chance)
    return name, text, ", ".join(way.__name__ for way in ways)
