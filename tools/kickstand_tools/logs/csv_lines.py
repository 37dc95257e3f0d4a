"""A table of numbers as lines of CSV, quickly."""

from .table import Array


def csv_lines(table: Array, digits: list[int]) -> str:
    """(n, m) with digits[k] after the point in column k; NaN is an empty cell."""
    form = ",".join(f"%.{digit}f" for digit in digits) + "\n"
    return "".join([form % tuple(row) for row in table.tolist()]).replace("nan", "")
