"""The base of results that are tables."""

from collections.abc import Container, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, extra
from ..signals import Array as Array
from ..signals import Bools

if TYPE_CHECKING:
    from pandas import DataFrame
    from pyarrow import Schema


@dataclass
class Table:
    """A dataclass whose arrays have one row per sample; its other fields belong to the whole table."""

    def columns(self) -> dict[str, NDArray[Any]]:
        """The arrays (n,) by the names of their fields."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def part(self, which: slice | Bools) -> Self:
        """The samples of a slice, or those where an array of n is True. The arrays of a slice are views of this
        table's; what is no array belongs to both."""
        # Table's columns are the fields; a Log's are named as in a CSV
        return replace(self, **{name: values[which] for name, values in Table.columns(self).items()})

    def to_pandas(self) -> "DataFrame":
        """A data frame of columns(). Raises InputError if pandas is not installed."""
        try:
            from pandas import DataFrame
        except ImportError as error:
            raise InputError("data frames need pandas: " + extra("rides")) from error
        return DataFrame(self.columns())


def float_schema(units: Mapping[str, str], fine: Container[str], about: dict[str, str]) -> "Schema":
    """Of a Parquet file: columns with their units, in 64-bit floats those of fine, the rest in 32-bit floats. about:
    its metadata."""
    import pyarrow

    return pyarrow.schema(
        [
            pyarrow.field(name, pyarrow.float64() if name in fine else pyarrow.float32(), metadata={"unit": unit})
            for name, unit in units.items()
        ],
        metadata=about,
    )
