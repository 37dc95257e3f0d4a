"""A road whose exact answer is known: an exact sensor and an exact receiver on random bends."""

import functools

import numpy as np
from kickstand_tools import api
from kickstand_tools.signals import EARTH_M

G, BEGIN_S = 9.80665, 1.7e9
ALONG = np.eye(3)  # the mount of a sensor along the bike's axes


def turned(angle_deg, axis=(1.0, 2.0, 3.0)):
    """Return a rotation matrix (Rodrigues)."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross, angle = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]), np.radians(angle_deg)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


@functools.cache
def road(seconds, seed=1, hz=20):
    """Return the log of a sensor with axes left, up and forward, and a track of 10 points per second, at 14 to 22
    m/s."""
    t_s = np.arange(0.0, seconds, 1.0 / hz)
    knots_s, random = np.arange(0.0, seconds + 12.0, 6.0), np.random.default_rng(seed)
    yaw = np.interp(t_s, knots_s, np.radians(25.0) * random.uniform(-1.0, 1.0, len(knots_s)))
    speed = np.interp(t_s, knots_s, random.uniform(14.0, 22.0, len(knots_s)))
    lean = -np.arctan(speed * yaw / G)
    rates = np.degrees(np.column_stack((np.zeros(len(t_s)), yaw * np.cos(lean), np.gradient(lean, t_s))))
    force = np.column_stack((np.zeros(len(t_s)), 1.0 / np.cos(lean), np.gradient(speed, t_s) / G))
    heading = np.cumsum(yaw) / hz
    north, east = (np.cumsum(speed * component(heading)) / hz for component in (np.sin, np.cos))
    lat, lon, speed_mps = (values[:: hz // 10] for values in (north / EARTH_M, east / EARTH_M, speed))
    utc_s = BEGIN_S + t_s[:: hz // 10]
    return api.Log(t_s, force, rates), api.Track(utc_s, np.degrees(lat), np.degrees(lon), speed_mps, "track")


def another_device(log, from_s=0.0, to_s=np.inf, drift=0.0, mount=ALONG, bias_dps=0.0):
    """Return the log of a device that starts later. Its clock is slow by `drift`, and its sensor is mounted askew."""
    part = (log.t_s >= from_s) & (log.t_s < to_s)
    t_s = (log.t_s[part] - from_s) * (1.0 - drift)
    return api.Log(t_s, log.accel_g[part] @ mount.T, log.gyro_dps[part] @ mount.T + bias_dps, name="ride")


def points(track, selection):
    return api.Track(*(values[selection] for values in track.columns().values()), name=track.name)
