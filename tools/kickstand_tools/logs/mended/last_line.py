"""The last line of a log, which a recorder that lost its power did not finish."""

from collections.abc import Iterator

from ...errors import InputError
from .. import cells


def last_marked(pieces: Iterator[tuple[bytes, int]]) -> Iterator[tuple[bytes, int, bool]]:
    """Each piece, and whether it is the last one."""
    before = next(pieces, None)
    for piece in pieces:
        if before:
            yield *before, False
        before = piece
    if before:
        yield *before, True


def without_cut_line(text: bytes, names: list[str], places: dict[str, int]) -> tuple[bytes, bytes]:
    """The end of a log without its last line if that was cut, and the cut line: empty if it was not.

    text: whole lines, of which the last one may have no end. It was cut if it has fewer cells than there are columns;
    without an end also if it cannot be read, or if its last number has fewer digits after the point than the line
    before it: half a number is a number too.
    """
    kept = text.rstrip()
    before, _, last = kept.rpartition(b"\n")
    if not last or last.count(b'"'):
        return text, b""
    cut = last.count(b",") + 1 < len(names)
    if not cut and not text.endswith(b"\n"):
        above = before.rpartition(b"\n")[2]
        half = not last.endswith(b",") and _digits(last) < _digits(above)
        cut = half or not _readable(last, names, places)
    return (before + b"\n" if before else b"", last) if cut else (text, b"")


def _readable(line: bytes, names: list[str], places: dict[str, int]) -> bool:
    try:
        return len(cells.read("", line.decode(), len(names), places, 0, None)) == 1
    except (InputError, UnicodeDecodeError):
        return False


def _digits(line: bytes) -> int:
    """After the point of the last cell; 0 for an empty one."""
    return len(line.rpartition(b",")[2].strip().partition(b".")[2])
