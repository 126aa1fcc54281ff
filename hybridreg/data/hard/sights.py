# SPDX-License-Identifier: MIT
"""Sensors, and what one of them sees of a place: points with the normals of the surfaces they lie on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.simulate.sensing.caster import World
from hybridreg.data.simulate.sensing.patterns import pattern
from hybridreg.data.simulate.sensing.sensors import Sensor
from hybridreg.geometry import se3

Array = NDArray[np.float64]
AROUND = ("rings16", "rings32", "rings64", "hemisphere")
AHEAD = ("fan", "rosette")
LIDARS = (*AROUND, *AHEAD)
_ELEVATIONS = {
    "rings16": (-15, 15, 16),
    "rings32": (-30, 10, 32),
    "rings64": (-25, 3, 64),
    "hemisphere": (-15, 89, 64),
}


@dataclass(frozen=True, eq=False)
class Rays:
    """Unit directions (n, 3), the range in metres, and the noise: metres, plus metres at 1 m that grow squared."""

    directions: Array
    far: float
    noise: float
    growth: float = 0.0
    near: float = 0.4


@dataclass(frozen=True, eq=False)
class Shot:
    """Points (N, 3) and unit normals in a frame, and the frame's pose in the world (4, 4)."""

    points: Array
    normals: Array
    T_world: Array

    def within(self, T_world: Array) -> Shot:
        """The same points in the frame that stands at `T_world`."""
        T = se3.inverse(T_world) @ self.T_world
        return Shot(se3.apply(T, self.points), self.normals @ T[:3, :3].T, T_world)

    def kept(self, which: NDArray) -> Shot:
        """Some of the points: a mask or an index."""
        return Shot(self.points[which], self.normals[which], self.T_world)


def lidar(name: str, rng: np.random.Generator, far: float = 80.0, columns: int = 900) -> Rays:
    """A LiDAR of `LIDARS`, with 1 to 3 cm of noise."""
    noise = rng.uniform(0.01, 0.03)
    if name in _ELEVATIONS:
        low, high, beams = _ELEVATIONS[name]
        columns = columns // 2 if name == "hemisphere" else columns
        steps = tuple(float(e) for e in np.linspace(low, high, beams))
        made = Sensor(name=name, kind="spinning", elevations_deg=steps, points=beams * columns)
    elif name == "fan":
        made = Sensor(name=name, kind="raster", fov_deg=(rng.uniform(60, 120), 25.0), points=30_000)
    else:
        made = Sensor(name=name, kind="rosette", fov_deg=(70.0, 77.0), points=24_000)
    return Rays(pattern(made, rng).astype(float), far, noise)


def camera(
    fov_deg: tuple[float, float], far: float, noise: float, growth: float = 0.0, near: float = 0.1
) -> Rays:
    """A depth camera of 240 by 180 pixels that looks along x."""
    wide, high = np.tan(np.radians(fov_deg) / 2.0)
    y, z = np.meshgrid(np.linspace(wide, -wide, 240), np.linspace(high, -high, 180))
    d = np.c_[np.ones(y.size), y.ravel(), z.ravel()]
    return Rays(d / np.linalg.norm(d, axis=1, keepdims=True), far, noise, growth, near)


def planar(beams: int, span_deg: float, far: float, noise: float) -> Rays:
    """A 2-D scanner."""
    a = np.radians(np.linspace(-span_deg / 2, span_deg / 2, beams, endpoint=False))
    return Rays(np.c_[np.cos(a), np.sin(a), np.zeros(beams)], far, noise)


def pose(x: float, y: float, z: float, yaw: float, pitch: float = 0.0, roll: float = 0.0) -> Array:
    """Pose (4, 4) of a frame that is turned about z, then y (positive: nose down), then its own x; degrees."""
    R = se3.yaw(yaw)[:3, :3]
    R = (
        R
        @ se3.rotation_about(np.radians([0.0, pitch, 0.0]))
        @ se3.rotation_about(np.radians([roll, 0.0, 0.0]))
    )
    return se3.from_rt(R, np.array([x, y, z], float))


def level(rng: np.random.Generator, x: float, y: float, z: float, lean: float = 1.0) -> Array:
    """Pose (4, 4) of a sensor of any yaw tilted by about `lean` degrees."""
    return pose(x, y, z, rng.uniform(0.0, 360.0), rng.normal(0.0, lean), rng.normal(0.0, lean))


def look(world: World, rays: Rays, T_world: Array, rng: np.random.Generator) -> Shot:
    """What a sensor sees from `T_world`, in its own frame; one return in twenty is lost."""
    ahead = rays.directions @ T_world[:3, :3].T
    hits = world.cast(T_world[:3, 3], ahead)
    reach = hits.distance.astype(float)
    seen = (reach < rays.far) & (reach > rays.near) & (rng.random(len(reach)) > 0.05)
    reach, normals = reach[seen], hits.normal[seen].astype(float)
    reach = reach + rng.normal(0.0, 1.0, len(reach)) * (rays.noise + rays.growth * reach**2)
    return Shot(rays.directions[seen] * reach[:, None], normals @ T_world[:3, :3], T_world)


def merged(shots: list[Shot], T_world: Array) -> Shot:
    """Several shots in one frame."""
    parts = [shot.within(T_world) for shot in shots]
    return Shot(np.vstack([p.points for p in parts]), np.vstack([p.normals for p in parts]), T_world)


def thin(shot: Shot, size: float) -> Shot:
    """One point per voxel of `size` metres."""
    cell = np.floor((shot.points - shot.points.min(axis=0)) / size).astype(np.int64)
    _, first = np.unique((cell[:, 0] << 42) + (cell[:, 1] << 21) + cell[:, 2], return_index=True)
    return shot.kept(np.sort(first))
