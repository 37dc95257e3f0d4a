"""The units of apps, with their factors to a log's own: g, deg/s, m/s, seconds, degrees."""

import math
import re

from kickstand.units import STANDARD_GRAVITY

from ..errors import InputError

ACCELERATIONS = {"g": 1.0, "m/s2": 1.0 / STANDARD_GRAVITY, "mg": 1e-3}
RATES = {"deg/s": 1.0, "rad/s": math.degrees(1.0), "mdeg/s": 1e-3}
SPEEDS = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704, "knots": 1852.0 / 3600.0}
TIMES = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1}  # in ns
ANGLES = {"deg": 1.0, "min": 1.0 / 60.0}
_SPELLINGS = {
    "m/s2": "m/s/s m/sec2 mps2 ms2",
    "g": "gs",
    "deg/s": "dps °/s deg/sec degrees/s",
    "mdeg/s": "mdps",
    "rad/s": "radians/s rad/sec rps rads",
    "km/h": "kmh kph km/hr",
    "m/s": "mps",
    "mph": "mi/h",
    "knots": "knot kn kt kts",
    "s": "sec seconds",
    "ms": "msec",
    "us": "µs μs",
    "deg": "° degrees",
    "min": "minutes",
}
_SAME = {other: name for name, others in _SPELLINGS.items() for other in others.split()}


def unit(text: str) -> str:
    """A unit in the spelling of the tables above, where it is one of theirs: "m/s^2" is "m/s2"."""
    short = re.sub(r"[\s^*·]", "", text.strip().lower()).replace("²", "2").replace("s-2", "/s2").replace("//", "/")
    return _SAME.get(short, short)


def factor(text: str, kinds: dict[str, float], where: str) -> float:
    """The factor on a value in a unit; a - before the unit changes the sign. Raises InputError for another unit.

    >>> factor("-m/s^2", {"g": 1.0, "m/s2": 0.102}, "ax")
    -0.102
    """
    sign, bare = (-1.0, text.strip()[1:]) if text.strip().startswith("-") else (1.0, text)
    if unit(bare) not in kinds:
        raise InputError(f"{where}: unit {text!a} is not known: write one of {', '.join(kinds)}")
    return sign * kinds[unit(bare)]
