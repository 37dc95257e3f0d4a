"""Processes the log files of one mount of one vehicle: alignment, moves of the mount, and brake tests."""

import errno
import math
import traceback
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from kickstand.drive_alignment.quality import AGREE_DEG, fit_problem
from kickstand_tools.analysis.stops import Stop, brake_tests
from kickstand_tools.calibration.drive import DriveFit, fit_logs, usable
from kickstand_tools.calibration.file import CalibrationFile
from kickstand_tools.calibration.refusals import Uncertain, of_firmware
from kickstand_tools.checks.axes import LeftHanded
from kickstand_tools.checks.log import AccelClipped, AxisDead, FrozenReadings, GyroSaturated
from kickstand_tools.common.messages import InputError, RefusedInput, cause
from kickstand_tools.logs.log import Log
from kickstand_tools.logs.reader import CutLine
from kickstand_tools.logs.source import CutGzip, NulEnd

from . import evidence, files, signals
from .evidence import Forward, find_forward
from .manifest import Period
from .moved import Move, find_moves

UNREADABLE, CHANGED, NO_MEMORY, FAULT = "unreadable", "changed", "no-memory", "fault"
NO_SPEED, MOVED = "no-speed", "mount-moved"
# AFTERWARDS means that the vehicle is aligned, but brake tests or signals of this log are missing. DISK_FULL means that
# the disk has no space for the signals
AFTERWARDS, DISK_FULL = "not-finished", "disk-full"
# Notices about parts of a log that are not used, and about a faulty sensor
_REPORTED = (CutLine, CutGzip, NulEnd, FrozenReadings, AxisDead, GyroSaturated, AccelClipped)
# Refusals of the firmware whose cause may be a move of the mount
_SUSPECTS = (MOVED, "parts-differ", "uncertain")
_PLOTTED = 160  # largest number of intervals in a picture
_AGAINST = -0.5  # value of evidence.handedness() below which the gyro or the axes are mirrored

Row = dict[str, Any]


@dataclass
class PeriodResult:
    """The rows of one mount of one vehicle in tables.TABLES, and the points of its picture.

    A point of the picture has four numbers of one interval, all in g: change of speed, force forward, centripetal
    acceleration and force to the left.
    """

    alignment: Row
    moved: list[Row] = field(default_factory=list)
    brake_tests: list[Row] = field(default_factory=list)
    errors: list[Row] = field(default_factory=list)
    picture: list[list[float]] = field(default_factory=list)


def work_on_period(period: Period, signals_to: str | None = None) -> PeriodResult:
    """Align a period of a manifest, find where its mount moved, and measure its brake tests.

    signals_to: directory for each log's accelerations along the vehicle's axes. None writes no accelerations.

    Problems of the data are part of the result. Each log that cannot be used adds a row to the errors. If no log is
    left, the status is "error" or "refused". This function raises nothing, because one vehicle must not stop a fleet.

    >>> found = work_on_period(Period("bus 12", "", "car", ("no-such-file.csv",)))
    >>> found.alignment["status"], found.errors[0]["message"]
    ('error', 'no-such-file.csv: there is no such file')
    """
    try:
        return _printable(_result(period, signals_to))
    except MemoryError:
        return failed(period, NO_MEMORY, "its logs take more memory than there is")
    except OSError as error:
        return failed(period, UNREADABLE, cause(error))
    except Exception as error:  # any exception, because a bug in Kickstand must not affect other vehicles
        frame = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({Path(frame.filename).name}, line {frame.lineno})"
        return failed(period, FAULT, message)


def _printable(result: PeriodResult) -> PeriodResult:
    """Replace the bytes of names that are not UTF-8, because tables and pages cannot hold them."""
    for row in chain([result.alignment], result.moved, result.brake_tests, result.errors):
        row |= {key: files.printable(value) for key, value in row.items() if isinstance(value, str)}
    return result


def failed(period: Period, reason: str, message: str) -> PeriodResult:
    """Return the result for a period whose task failed, with the reason as a code and the message in words."""
    message = files.printable(message)
    row = _alignment(period, "error", reason, message, [], len(period.paths))
    return PeriodResult(row, errors=[_error(period, "", reason, message)])


def _result(period: Period, signals_to: str | None) -> PeriodResult:
    """Compute the result of a period. Raises any exception, see work_on_period()."""
    logs, errors = _logs(period)
    if not logs:
        refused = [row for row in errors if row["reason"] != UNREADABLE]
        cause_row = (refused or errors)[0]
        status = "refused" if refused else "error"
        row = _alignment(period, status, cause_row["reason"], cause_row["message"], [], len(errors))
        return PeriodResult(row, errors=errors)
    drive = _drive(period, logs)
    reason, message = _refusal(drive, logs)
    aligned = not reason
    row = _alignment(period, "aligned" if aligned else "refused", reason, message, logs, len(errors), drive)
    errors += [
        _error(period, log.name, notice.code, notice.line())
        for log in logs
        for notice in log.notices
        if isinstance(notice, _REPORTED)
    ]
    moved = [_vehicle_columns(period) | _moved_row(move, logs) for move in drive.moves]
    result = PeriodResult(row, moved, [], errors, _picture(drive))
    if aligned and drive.forward:
        calibration = CalibrationFile(
            gyro_bias_dps=drive.fit.bias_dps, vehicle_from_sensor=drive.forward.frame, aligned=True, vehicle=period.kind
        )
        for log in logs:
            _add_drive(result, period, log, calibration, signals_to)
    return result


@dataclass
class _Drive:
    fit: DriveFit  # alignment by the firmware's method
    # Intervals of each log. Empty if the firmware refused the logs and no other method can help.
    intervals: list[evidence.Intervals] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)  # moves of the mount
    forward: Forward | None = None  # alignment from all logs, or None if they do not determine it


def _drive(period: Period, logs: list[Log]) -> _Drive:
    fit = fit_logs(logs, None, period.kind)
    if fit.refusal and fit.reason not in _SUSPECTS:
        return _Drive(fit)
    driven = [evidence.intervals(log, period.kind, fit.lag_s or 0.0, fit.bias_dps) for log in logs]
    suspected = fit.reason in (MOVED, "parts-differ") or (fit.halves_deg or 0.0) > AGREE_DEG
    return _Drive(fit, driven, find_moves(driven, suspected), find_forward(driven, None if fit.refusal else fit))


def _refusal(drive: _Drive, logs: list[Log]) -> tuple[str, str]:
    """Return the reason why the vehicle is not aligned, as a code and a sentence, or two empty texts."""
    fit, forward = drive.fit, drive.forward
    if drive.moves:
        return MOVED, _moved_words(drive.moves, logs)
    reason = None
    if _mirrored(drive.intervals):
        reason = LeftHanded()
    elif fit.reason == MOVED:
        # The problem of a late speed, which makes braking look like a moved mount
        late = fit_problem(fit.lag_s or 0.0, 1.0)
        reason = of_firmware(late) if late else None
    elif forward and forward.sure:
        return "", ""
    elif forward and not fit.reason:
        reason = Uncertain(forward.sigma_deg, fit.used)
    refusal = RefusedInput(reason) if reason else fit.refusal
    return (refusal.code, str(refusal)) if refusal else ("", "")


def _add_drive(
    result: PeriodResult, period: Period, log: Log, calibration: CalibrationFile, signals_to: str | None
) -> None:
    try:
        tests = brake_tests(log, calibration)
        result.brake_tests += [_vehicle_columns(period) | {"log": log.name} | _stop_row(stop, log) for stop in tests]
        if signals_to is not None:
            signals.write(signals_to, period, log, calibration)
    except (InputError, OSError) as error:
        full = getattr(error.__cause__ or error, "errno", None) in (errno.ENOSPC, errno.EDQUOT)
        result.errors.append(_error(period, log.name, DISK_FULL if full else AFTERWARDS, cause(error)))


def _vehicle_columns(period: Period) -> Row:
    return {"vehicle": period.vehicle, "mount": period.mount}


def _error(period: Period, log: str, reason: str, message: str) -> Row:
    return _vehicle_columns(period) | {"log": log, "reason": reason, "message": message}


def _logs(period: Period) -> tuple[list[Log], list[Row]]:
    """Read the logs. Returns the logs that can be used, and a row of errors for each other log."""
    logs, errors = [], []
    for path in period.paths:
        reason = UNREADABLE
        try:
            log = files.open_log(path)
            if np.all(np.isnan(log.speed_mps)):
                reason = NO_SPEED
            logs.append(usable(log, False))
        except RefusedInput as error:
            errors.append(_error(period, path, error.code, str(error)))
        except (InputError, OSError) as error:
            errors.append(_error(period, path, reason, cause(error)))
    return logs, errors


def _alignment(
    period: Period, status: str, reason: str, message: str, logs: list[Log], left_out: int, drive: _Drive | None = None
) -> Row:
    """Return the row of the table alignments. logs: that were used. left_out: number of the other logs."""
    fit, forward = (drive.fit, drive.forward) if drive else (None, None)
    solution = forward if status == "aligned" else None
    return _vehicle_columns(period) | {
        "kind": period.kind,
        "status": status,
        "reason": reason,
        "message": message,
        "quality_deg": forward.sigma_deg if forward else None,
        "attitude_deg": forward.attitude_deg if forward else None,
        "halves_deg": forward.halves_deg if forward else None,
        "vehicle_from_sensor": solution.frame.ravel().tolist() if solution else None,
        "gyro_bias_dps": fit.bias_dps.tolist() if fit and solution else None,
        "speed_lag_s": fit.lag_s if fit else None,
        "stops": fit.stops if fit else 0,
        "events_used": fit.used if fit else 0,
        "events_in_turns": fit.turned if fit else 0,
        "logs": len(logs),
        "logs_left_out": left_out,
        "driven_s": float(sum(log.t_s[-1] for log in logs)),
        "start_utc_s": _utc_s(logs[0], 0.0) if logs else None,
        "plot": "",
    }


def _mirrored(driven: list[evidence.Intervals]) -> bool:
    """Detect mirrored axes. With mirrored axes, the yaw rate in bends predicts the force on the wrong side."""
    regression = evidence.blocks(driven)
    if not len(regression.log):
        return False
    coefficients, varied = evidence.fits(np.sum(regression.square, axis=0), np.sum(regression.product, axis=0))
    return evidence.handedness(coefficients, varied) <= _AGAINST


def _moved_words(moves: list[Move], logs: list[Log]) -> str:
    first = moves[0]
    name = logs[first.log].name
    repeats = f", and {len(moves) - 1} times more" if len(moves) > 1 else ""
    turned = f"the mount was turned by {first.angle_deg:.0f} degrees"
    if first.at_s is None:
        return f"{turned} before {name}{repeats}: give {name} and the logs after it another mount in the manifest"
    return (
        f"{turned} in {name} at {first.at_s:.0f} s{repeats}: cut it there (kickstand cut), and give the second part "
        "and the logs after it another mount in the manifest"
    )


def _moved_row(move: Move, logs: list[Log]) -> Row:
    log = logs[move.log]
    return {
        "log": log.name,
        "within_log": move.at_s is not None,
        "at_s": move.at_s,
        "utc_s": _utc_s(log, move.at_s or 0.0),
        "turned_deg": move.angle_deg,
        "turned_sigma_deg": move.angle_sigma_deg,
        "sigmas": move.sigmas,
        **dict(zip(("about_left_deg", "about_up_deg", "about_forward_deg"), move.turn_deg.tolist())),
    }


def _stop_row(stop: Stop, log: Log) -> Row:
    names = ("start_s", "initial_speed_mps", "duration_s", "distance_m", "mfdd_mps2", "peak_mps2", "jerk_mps3")
    row: Row = {name: float(getattr(stop, name)) for name in (*names, "side_m", "heading_deg")}
    return row | {"utc_s": _utc_s(log, stop.start_s), "speed_from": stop.speed_from}


def _utc_s(log: Log, at_s: float) -> float | None:
    """Return the Universal Time at at_s of the log, in s since 1970, or None."""
    return None if log.start_utc_s is None else log.start_utc_s + at_s


def _picture(drive: _Drive) -> list[list[float]]:
    """Compute the points of the picture (see PeriodResult). Their scatter shows a move of the mount."""
    if not drive.forward:
        return []
    weighted = [log.weight > 0.0 for log in drive.intervals]
    terms = np.concatenate([log.terms[rows] for log, rows in zip(drive.intervals, weighted)])
    force = np.concatenate([log.force[rows] for log, rows in zip(drive.intervals, weighted)]) @ drive.forward.frame.T
    table = np.column_stack((terms[:, 1], force[:, 2], terms[:, 2], force[:, 0]))
    step = max(1, math.ceil(len(table) / _PLOTTED))
    return table[::step].round(3).tolist()
