"""Decodes the radio's packets with the equations for RaceChrono and the tables of bytes in firmware/docs/live.md.

The decoder uses nothing else, so it also tests that document.
"""

import re
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "firmware" / "docs" / "live.md"
_SECTION = PAGE.read_text(encoding="utf-8")
SERVICE = re.findall(r"is `([0-9a-f-]{36})`", _SECTION)[0]

# {channel: (packet, equation)}. A channel's name ends before the first comma.
EQUATIONS = {
    name.split(",")[0]: (int(packet), equation)
    for name, packet, equation in re.findall(r"^\| ([^|]+) \| (\d) \| `(.+)` \|$", _SECTION, re.MULTILINE)
}
_FUNCTIONS = {
    "bytesToIntLe": lambda raw, at, length: int.from_bytes(raw[at : at + length], "little", signed=True),
    "bytesToUintLe": lambda raw, at, length: int.from_bytes(raw[at : at + length], "little"),
}


def channels(data):
    """Return {channel: value} of a packet of RaceChrono's service."""
    number, raw = int.from_bytes(data[:4], "little"), bytes(data[4:])
    assert 1 <= len(raw) <= 16
    return {
        name: eval(equation, {"__builtins__": {}}, {**_FUNCTIONS, "raw": raw})
        for name, (packet, equation) in EQUATIONS.items()
        if packet == number
    }


def _rows(title):
    """Return the rows of a table: [(first byte, last byte, kind, text, value that means unknown, or None), ...]."""
    table = _SECTION.split(f"\n`{title}`, ")[1].split("\n\n")[1]
    rows = []
    for line in table.splitlines()[2:]:
        position, kind, quantity, *unknown = (cell.strip() for cell in line.strip("|").split("|"))
        first, _, last = position.partition("-")
        lacking = int(unknown[0]) if unknown and unknown[0] else None
        rows.append((int(first), int(last or first), kind, quantity, lacking))
    return rows


def own(title, data):
    """Decode a packet of Kickstand's own service. Return {quantity: integer in the table's unit, or None}.

    None means that the value is unknown.
    """
    rows = _rows(title)
    assert len(data) == rows[-1][1] + 1
    values = {}
    for first, last, kind, quantity, lacking in rows:
        number = int.from_bytes(bytes(data[first : last + 1]), "little", signed=kind == "signed")
        values[re.split("[,:]", quantity)[0]] = None if number == lacking else number
    return values
