"""Makes windows of a ride for the tests in this folder."""

from dataclasses import replace
from typing import Any

import numpy as np
from kickstand_tools.estimation.windows import Windows


def windows(n: int = 20, rate: Any = (0.0, 0.0, 0.0), force: Any = (0.0, 1.0, 0.0), speed: Any = np.nan, **more):
    """Return n windows of 0.2 s each. rate, force: shape (3) or (n, 3). more: other fields of Windows."""
    rate, force = (np.array(np.broadcast_to(np.asarray(of, dtype=float), (n, 3))) for of in (rate, force))
    made = Windows(
        np.asarray(np.arange(n + 1) * 0.2, dtype=float), rate, force, np.zeros(n),
        np.full(n, speed), np.zeros(n), np.zeros(n, dtype=bool), np.arange(n), np.full(n, 0.1), np.full(n, 0.1),
    )  # fmt: skip
    return replace(made, **more)
