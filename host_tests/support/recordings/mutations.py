"""Logs broken in many ways, each by a number: the same number breaks the same log in the same way."""

import gzip
import random

WORDS = (
    *("nan", "NaN", "inf", "-inf", "1e308", "-1e308", "1e999", "1e-320", "5e15", "-0", "+-1", "1_0", "0x10", "1e", "."),
    *("", " ", "--", "null", '"', '"0', "0\x00", "\u0663", "\uff11", "\u00e9", "1,5", "1;5", "1 5", "9" * 400, "'"),
)
SIZES = (0.0, 1e-3, 1e-6, 9.80665, 57.29578, 1000.0, 1e6, 1e12, -1.0)


def _cells(text: bytes) -> list[list[bytes]]:
    return [line.split(b",") for line in text.split(b"\n")]


def _text(rows: list[list[bytes]]) -> bytes:
    return b"\n".join(b",".join(row) for row in rows)


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


def double_lines(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    at = chance.randrange(len(lines))
    many = chance.choice((1, 1, 5, 60))
    return b"\n".join(lines[:at] + lines[at : at + 1] * many + lines[at:])


def exchange_lines(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    a, b = chance.randrange(len(lines)), chance.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def shuffle_lines(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    rest = lines[1:]
    chance.shuffle(rest)
    return b"\n".join(lines[:1] + rest)


def lose_a_column(text: bytes, chance: random.Random) -> bytes:
    rows = _cells(text)
    place = chance.randrange(max(1, len(rows[0])))
    return _text([row[:place] + row[place + 1 :] for row in rows])


def exchange_columns(text: bytes, chance: random.Random) -> bytes:
    rows = _cells(text)
    width = max(1, len(rows[0]))
    a, b = chance.randrange(width), chance.randrange(width)
    header = chance.random() < 0.5  # with their names, or without
    for row in rows[0 if header else 1 :]:
        if len(row) > max(a, b):
            row[a], row[b] = row[b], row[a]
    return _text(rows)


def rename_a_column(text: bytes, chance: random.Random) -> bytes:
    rows = _cells(text)
    rows[0][chance.randrange(len(rows[0]))] = chance.choice((b"", b"ax_g", b"speed_mps", b"time", b"lean_deg", b'"'))
    return _text(rows)


def put_a_word(text: bytes, chance: random.Random) -> bytes:
    rows = _cells(text)
    for _ in range(chance.choice((1, 1, 4, 100))):
        row = chance.choice(rows)
        row[chance.randrange(len(row))] = chance.choice(WORDS).encode()
    return _text(rows)


def scale_a_column(text: bytes, chance: random.Random) -> bytes:
    rows, size = _cells(text), chance.choice(SIZES)
    places = chance.choice(([0], [1, 2, 3], [4, 5, 6], [7], [1], [5]))
    begin = chance.choice((1, len(rows) // 2))
    for row in rows[begin:]:
        for place in places:
            if len(row) > place:
                try:
                    row[place] = b"%.9g" % (float(row[place]) * size)
                except ValueError:
                    continue
    return _text(rows)


def shift_the_time(text: bytes, chance: random.Random) -> bytes:
    rows, by = _cells(text), chance.choice((-1.0, -1e-3, 1e-7, 0.3, 60.0, 1e6, 1.7e9, 9.9e9))
    for row in rows[chance.randrange(1, max(2, len(rows))) :]:
        try:
            row[0] = b"%.6f" % (float(row[0]) + by)
        except ValueError:
            continue
    return _text(rows)


def round_the_time(text: bytes, chance: random.Random) -> bytes:
    rows, digits = _cells(text), chance.choice((0, 1, 2))
    for row in rows[1:]:
        try:
            row[0] = b"%.*f" % (digits, float(row[0]))
        except ValueError:
            continue
    return _text(rows)


def go_wild(text: bytes, chance: random.Random) -> bytes:
    """Readings up to the ends of the widest ranges."""
    rows = _cells(text)
    begin = chance.choice((1, len(rows) // 3))
    g, dps = chance.choice(((19.0, 2400.0), (4.0, 2400.0), (19.0, 10.0)))
    for row in rows[begin : begin + chance.choice((1, 20, 1000))]:
        if len(row) > 6:
            row[1:7] = [b"%.4f" % chance.uniform(-most, most) for most in (g, g, g, dps, dps, dps)]
    return _text(rows)


def freeze(text: bytes, chance: random.Random) -> bytes:
    rows = _cells(text)
    at = chance.randrange(len(rows))
    for row in rows[at : at + chance.choice((10, 60, 10_000))]:
        row[1:] = rows[at][1:]
    return _text(rows)


def other_separators(text: bytes, chance: random.Random) -> bytes:
    text = text.replace(b".", b",") if chance.random() < 0.3 else text
    return text.replace(b",", chance.choice((b";", b"\t", b" ", b", ", b"|", b",,")))


def other_lines(text: bytes, chance: random.Random) -> bytes:
    return text.replace(b"\n", chance.choice((b"\r", b"\r\n", b"\n\n", b"\n\r", b"\x0b", b" \n", b"\n \n", b",\n")))


def other_encoding(text: bytes, chance: random.Random) -> bytes:
    name = chance.choice(("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig", "cp037", "utf-7"))
    return text.decode("latin-1").encode(name, "replace")


def put_nul_bytes(text: bytes, chance: random.Random) -> bytes:
    at = chance.choice((0, len(text), chance.randrange(len(text) + 1)))
    return text[:at] + bytes(chance.choice((1, 7, 5000))) + (text[at:] if chance.random() < 0.5 else b"")


def quote(text: bytes, chance: random.Random) -> bytes:
    at = chance.randrange(len(text) + 1)
    return text[:at] + b'"' + text[at:]


def a_long_line(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    lines[chance.randrange(len(lines))] += chance.choice((b"1", b",", b"x", b" ")) * 200_000
    return b"\n".join(lines)


def nearly_nothing(text: bytes, chance: random.Random) -> bytes:
    lines = text.split(b"\n")
    return chance.choice((b"", b"\n", b" ", lines[0], lines[0] + b"\n", b"\n".join(lines[:2]), b"\n".join(lines[:3])))


def pack(text: bytes, chance: random.Random) -> bytes:
    """With gzip's magic, whatever the name says."""
    return gzip.compress(text, 1, mtime=0)


WAYS = [
    *(flip_bytes, cut_end, cut_a_piece, double_lines, exchange_lines, shuffle_lines, lose_a_column, exchange_columns),
    *(rename_a_column, put_a_word, scale_a_column, shift_the_time, round_the_time, freeze, go_wild),
    *(other_separators, other_lines, other_encoding, put_nul_bytes, quote, a_long_line, nearly_nothing, pack),
]


def broken(bases: list[bytes], number: int) -> tuple[str, bytes, str]:
    """Name and content of a file, and the ways in which it was broken, one to three of them."""
    chance = random.Random(number)
    text = chance.choice(bases)
    ways = [WAYS[number % len(WAYS)], *chance.choices(WAYS, k=chance.choice((0, 0, 1, 2)))]
    for way in ways:
        text = way(text, chance)
    name = "RIDE.csv"
    if chance.random() < 0.2:
        name, text = "RIDE.csv.gz", gzip.compress(text, 1, mtime=0)
        if chance.random() < 0.7:
            again = chance.choice((flip_bytes, cut_end, put_nul_bytes, cut_a_piece))
            ways.append(again)
            text = again(text, chance)
    return name, text, ", ".join(way.__name__ for way in ways)
