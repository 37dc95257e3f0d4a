"""Numbers as lines of text, quickly."""

import numpy as np
from numpy.typing import NDArray


def text_rows(table: NDArray[np.float64], digits: list[int], between: str = ",", end: str = "\n") -> str:
    """(n, m) with digits[k] after the point in column k; NaN is an empty cell."""
    form = between.join(f"%.{digit}f" for digit in digits) + end
    return "".join([form % tuple(row) for row in table.tolist()]).replace("nan", "")
