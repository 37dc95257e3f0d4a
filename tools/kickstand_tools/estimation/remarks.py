"""Remarks on a smoothed lean: errors that its standard deviation does not contain, or only in part."""

from collections.abc import Iterable

import numpy as np
from kickstand.errors import Notice

from ..refusals import WRONG_AXES, WRONG_MOUNT
from ..signals import Array, Bools

DOUBTFUL = 0.2  # share of the riding; more is remarked
# Largest lean in which a bike is in balance on straights, if the upright pose was right and no luggage sits on one side
POSE_DEG = 1.8
CAUSES = WRONG_AXES | WRONG_MOUNT  # reasons why accelerations do not fit a bike: then nothing is said of the pose


class SmoothedRemarks:
    """Collects a smoothed ride, part by part, with add()."""

    def __init__(self) -> None:
        self._doubtful_s = self._riding_s = self._leaned = 0.0

    def add(self, seconds: Array, riding: Bools, doubtful: Bools, pose_rad: float) -> None:
        """Take n windows of so many seconds. doubtful: True where accelerations are not the bike's. pose_rad: lean to
        the right, by the upright pose, in which the bike is in balance on straights."""
        riding_s = float(np.sum(seconds[riding]))
        self._riding_s += riding_s
        self._doubtful_s += float(np.sum(seconds[riding & doubtful]))
        self._leaned += riding_s * float(np.degrees(pose_rad))

    def remarks(self, known: Iterable[Notice]) -> list[Notice]:
        """Those about the whole ride. known: what is remarked of it already."""
        if not self._riding_s or any(notice.code in CAUSES for notice in known):
            return []
        share, pose_deg = self._doubtful_s / self._riding_s, self._leaned / self._riding_s
        found = [Notice("not-the-bikes", 100.0 * share)] if share > DOUBTFUL else []
        return [*found, Notice("pose-off", pose_deg)] if abs(pose_deg) > POSE_DEG else found
