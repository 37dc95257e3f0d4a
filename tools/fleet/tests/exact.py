"""Intervals and blocks of a drive without any error, for a mount that is known exactly."""

import numpy as np
from fleet_drives import turn_of
from kickstand_fleet.evidence import Blocks, Intervals

LEFT, UP, FORWARD = np.eye(3)
MOUNT = turn_of(50.0, (1.0, 2.0, 3.0))  # from the sensor's axes to left, up, forward
NO_SWAY = np.zeros((3, 3))


def drive_intervals(seconds, turn_deg=0.0, axis=UP, from_s=0.0, arm=0.0, speed=10.0):
    """Return intervals of one second with braking and bends.

    turn_deg: rotation of the sensor from from_s on, a number or one angle per interval.
    arm: force to the left in g if the yaw rate changes by 1 rad/s2.
    """
    count = int(seconds)
    t_s, k = np.linspace(0.5, count - 0.5, count), np.arange(count)
    a, c, w = (size * np.where(k % period < period / 2, -1.0, 1.0) for size, period in ((0.2, 4), (0.1, 8), (0.3, 2)))
    terms = np.column_stack((np.ones(count), a, c, w if arm else 0.0 * w))
    turns = np.where(t_s > from_s, turn_deg, 0.0)
    mounts = [turn_of(turn, axis) @ MOUNT for turn in turns]
    force = np.array([row[0] * m[1] + row[1] * m[2] + (row[2] + arm * row[3]) * m[0] for row, m in zip(terms, mounts)])
    return Intervals(t_s, force, terms, np.ones(count), np.full(count, speed), np.zeros((count, 3, 3)))


def block_group(turn_deg=0.0, axis=UP, count=8, varied=1.0, sway=NO_SWAY, log=0):
    """Return equal blocks of a mount that was rotated by an angle.

    varied: variation of braking in all blocks, in g^2 s. sway: covariance along the vehicle's axes, of each block.
    """
    mount = turn_of(turn_deg, axis) @ MOUNT
    a = np.sqrt(varied / count / 4.0)
    terms = np.array([[1.0, sign * a, other * a, 0.0] for sign in (-1.0, 1.0) for other in (-1e-3, 1e-3)])
    force = terms[:, :3] @ np.array([mount[1], mount[2], mount[0]])
    begin_s = np.linspace(0.0, 8.0 * (count - 1), count)
    square, product, swayed = (
        np.tile(sums, (count, 1, 1)) for sums in (terms.T @ terms, terms.T @ force, mount.T @ sway @ mount)
    )
    return Blocks(square, product, swayed, np.full(count, log), begin_s, begin_s + 7.0)
