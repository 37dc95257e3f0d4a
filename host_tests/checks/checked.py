"""A log, or arrays, as the checks take them."""

import numpy as np
from kickstand_tools.checks.cells import CellTable, LogCells
from kickstand_tools.logs.log import Log
from kickstand_tools.refusals import sentence


def cells_of(log: Log, accel=None, gyro=None, speed=True, block=1_000_000) -> LogCells:
    """accel, gyro (3, 3): by which the sensors' axes are exchanged and reversed; a number makes the readings larger."""
    force = log.accel_g if accel is None else log.accel_g @ np.transpose(accel)
    rate = log.gyro_dps if gyro is None else log.gyro_dps @ np.transpose(gyro)
    mps = log.speed_mps if speed else np.full(len(log.t_s), np.nan)
    table = CellTable()
    for k in range(0, len(log.t_s), block):
        part = slice(k, k + block)
        table.add(log.t_s[part], force[part], rate[part], mps[part], log.lat_deg[part], log.lon_deg[part])
    cells = table.cells()
    assert cells is not None
    return cells


def words(notice) -> str:
    """In words, "" for nothing."""
    return sentence(notice) if notice else ""
