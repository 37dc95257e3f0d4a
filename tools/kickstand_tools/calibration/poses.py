"""Averages one recorded still pose with the firmware's own module."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from kickstand.calibration.still_pose import StillPose
from kickstand.errors import CaptureError

from ..errors import InputError
from ..logs.reader import Source, read_log
from ..logs.table import Array
from ..refusals import RefusedInput

_MICRO = 1_000_000  # StillPose sums integers: millionths of g and deg/s
_SATURATED = 1_990_000  # a still pose is measured with a range of 2 g or more: an axis at 2 g is at its end


@dataclass
class Pose:
    """The mean of one still pose. name: of its log; still: the firmware's own object."""

    name: str
    still: StillPose

    @property
    def samples(self) -> int:
        """Number of samples that were averaged."""
        return self.still.count

    @property
    def accel_g(self) -> Array:
        """(3) mean specific force, sensor's axes, not calibrated."""
        return np.array(self.still.accel)

    @property
    def gyro_dps(self) -> Array:
        """(3) mean angular rate of the sensor at rest: the gyro's bias."""
        return np.array(self.still.gyro)


def read_pose(source: Source) -> Pose:
    """Average a recorded pose (see read_log for source). Raises InputError naming the file; RefusedInput, a subclass,
    where the pose was not still."""
    log = read_log(source)
    still = StillPose(_MICRO, _MICRO, _SATURATED, len(log.t_s))
    where = log.name
    try:
        for number, (_, reading, _) in enumerate(log.rows(), 1):
            where = f"{log.name}, sample {number}"
            still.add([round(value * _MICRO) for value in reading])
        where = f"{log.name}: pose refused"
        still.finish()
    except CaptureError as error:
        raise RefusedInput(error, where, ": capture this pose again") from error
    return Pose(log.name, still)


def refuse_same_file(sources: Sequence[Source]) -> None:
    """Raise InputError if a path is given twice."""
    seen: set[Path] = set()
    for path in (Path(source) for source in sources if isinstance(source, (Path, str))):
        if path.resolve() in seen:
            raise InputError(f"{path} is given twice: each one has to be a recording of its own")
        seen.add(path.resolve())
