# SPDX-License-Identifier: MIT
"""A small world of boxes, posts and bushes on a plane, and sensors that scan it: data with exact poses.

Written for the tests and for the figures behind the verdict's weights, so that neither needs real data.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3

Array = NDArray[np.float64]


@dataclass
class World:
    """Boxes (centre, half size, yaw), posts (x, y, radius, height), bushes (centre, radius) on the plane z = 0."""

    boxes: list[tuple[Array, Array, float]] = field(default_factory=list)
    posts: list[tuple[float, float, float, float]] = field(default_factory=list)
    bushes: list[tuple[Array, float]] = field(default_factory=list)
    ceiling: float = np.inf

    def box(self, x: float, y: float, size: tuple[float, float, float], yaw: float = 0.0) -> None:
        half = np.array(size) / 2.0
        self.boxes.append((np.array([x, y, half[2]]), half, yaw))


def street(rng: np.random.Generator, crossing: bool = False) -> World:
    """Houses of varying width and setback along x, cars at the kerb, lamp posts and trees."""
    world = World()
    for side in (-1, 1):
        x = -70.0
        while x < 70.0:
            width, gap = rng.uniform(6, 18), rng.choice([0.0, rng.uniform(2, 10)])
            if not (crossing and abs(x + width / 2) < 12):
                y = side * (rng.uniform(8, 13) + 5)
                world.box(x + width / 2, y, (width, 10.0, rng.uniform(4, 14)))
            x += width + gap
        for x in np.arange(-65, 65, rng.uniform(6, 12)):
            if rng.random() < 0.6:
                world.box(
                    x + rng.uniform(-1, 1), side * rng.uniform(4, 5.5), (4.3, 1.8, 1.5), rng.normal(0, 0.05)
                )
        for x in np.arange(-60, 60, rng.uniform(12, 22)):
            world.posts.append((x + rng.uniform(-2, 2), side * 6.5, 0.15, 7.0))
            if rng.random() < 0.5:
                world.bushes.append((np.array([x + 5, side * 7.0, rng.uniform(1, 4)]), rng.uniform(0.8, 2.0)))
    return world


def yard(rng: np.random.Generator) -> World:
    """Scattered containers, cars and posts on an open place."""
    world = World()
    for _ in range(rng.integers(8, 25)):
        x, y = rng.uniform(-35, 35, 2)
        size = (rng.uniform(2, 10), rng.uniform(2, 4), rng.uniform(1.4, 4))
        if np.hypot(x, y) > 8:
            world.box(x, y, size, rng.uniform(0, np.pi))
    for _ in range(rng.integers(3, 15)):
        x, y = rng.uniform(-35, 35, 2)
        world.posts.append((x, y, rng.uniform(0.1, 0.4), rng.uniform(3, 8)))
    return world


def wood(rng: np.random.Generator) -> World:
    """Trunks and bushes."""
    world = World()
    for _ in range(rng.integers(40, 120)):
        x, y = rng.uniform(-40, 40, 2)
        if np.hypot(x, y) > 2:
            world.posts.append((x, y, rng.uniform(0.1, 0.35), 9.0))
    for _ in range(rng.integers(10, 40)):
        x, y = rng.uniform(-40, 40, 2)
        if np.hypot(x, y) > 5:
            world.bushes.append((np.array([x, y, rng.uniform(0.3, 5)]), rng.uniform(0.7, 2.5)))
    return world


def room(rng: np.random.Generator, corridor: bool = False) -> World:
    """Four walls, a ceiling and furniture; a corridor is long and nearly bare."""
    world = World(ceiling=rng.uniform(2.4, 4.0))
    a, b = (40.0, 1.3) if corridor else (rng.uniform(3, 9), rng.uniform(2.5, 7))
    for x, y, w, d in ((a, 0, 0.2, 2 * b), (-a, 0, 0.2, 2 * b), (0, b, 2 * a, 0.2), (0, -b, 2 * a, 0.2)):
        world.box(x, y, (w, d, world.ceiling))
    for _ in range(rng.integers(2, 5) if corridor else rng.integers(4, 14)):
        x, y = rng.uniform(-a, a), rng.uniform(-b, b)
        if np.hypot(x, y) > 1.2 and not (corridor and abs(y) < 0.8):
            size = (rng.uniform(0.3, 1.8), rng.uniform(0.3, 1.0), rng.uniform(0.4, 2.0))
            world.box(x, y, size, rng.choice([0, np.pi / 2, 0.4]))
    return world


def scan(
    world: World, sensor: str, T_world_sensor: Array, rng: np.random.Generator, density: float = 1.0
) -> Array:
    """Returns (N, 3) in the sensor's frame, with 2 cm of noise and 5 % of the returns lost."""
    local = rays(sensor, density, rng)
    d = local @ T_world_sensor[:3, :3].T
    reach = _cast(world, T_world_sensor[:3, 3], d, rng)
    hit = (reach < 90.0) & (rng.random(len(reach)) > 0.05)
    return local[hit] * (reach[hit] + rng.normal(0, 0.02, hit.sum()))[:, None]


def rays(sensor: str, density: float, rng: np.random.Generator) -> Array:
    """Unit directions (n, 3): "rings16", "rings32", "rings64", "hemisphere", "rosette" or "raster"."""
    if sensor.startswith("rings"):
        n = int(sensor[5:])
        low, high = {16: (-15, 15), 32: (-30, 10), 64: (-25, 3)}[n]
        elevation = np.radians(np.linspace(low, high, n))
        azimuth = np.linspace(-np.pi, np.pi, int(900 * density), endpoint=False)
        e, a = (g.ravel() for g in np.meshgrid(elevation, azimuth))
    elif sensor == "hemisphere":
        elevation = np.radians(np.linspace(-15, 89, 64))
        e, a = (g.ravel() for g in np.meshgrid(elevation, np.linspace(-np.pi, np.pi, int(400 * density))))
    elif sensor == "raster":
        e, a = (
            g.ravel()
            for g in np.meshgrid(
                np.radians(np.linspace(-12.5, 12.5, 100)), np.radians(np.linspace(-60, 60, 300))
            )
        )
    elif sensor == "rosette":
        t = np.linspace(0, 1, int(24_000 * density)) + rng.random()
        rho = np.radians(35.0) * np.abs(np.sin(2 * np.pi * 701.3 * t))
        turn = 2 * np.pi * 97.7 * t
        e, a = rho * np.sin(turn), rho * np.cos(turn)
    else:
        raise ValueError(f"no sensor is called {sensor!r}")
    return np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def sensor_pose(x: float, y: float, z: float, yaw_deg: float, tilt_deg: float = 0.0) -> Array:
    """T_world_sensor of a sensor that is turned about z, then tilted about its own x (180: upside down)."""
    T = se3.yaw(yaw_deg)
    T[:3, :3] = T[:3, :3] @ se3.rotation_about(np.array([np.radians(tilt_deg), 0.0, 0.0]))
    T[:3, 3] = x, y, z
    return T


def _cast(world: World, o: Array, d: Array, rng: np.random.Generator) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(d[:, 2] < 0, -o[2] / d[:, 2], np.inf)
        reach = np.minimum(reach, np.where(d[:, 2] > 0, (world.ceiling - o[2]) / d[:, 2], np.inf))
        for box in world.boxes:
            reach = np.minimum(reach, _hit_box(box, o, d))
        for post in world.posts:
            reach = np.minimum(reach, _hit_post(post, o, d))
        for centre, radius in world.bushes:
            reach = np.minimum(reach, _hit_bush(centre, radius, o, d, rng))
    return reach


def _hit_box(box: tuple[Array, Array, float], o: Array, d: Array) -> Array:
    centre, half, yaw = box
    R = se3.yaw(np.degrees(yaw))[:3, :3]
    start, along = (o - centre) @ R, d @ R
    a, b = (-half - start) / along, (half - start) / along
    near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    # From inside a box (the walls of a room are boxes of their own) there is no hit.
    return np.where((near <= far) & (near > 0), near, np.inf)


def _hit_post(post: tuple[float, float, float, float], o: Array, d: Array) -> Array:
    x, y, radius, height = post
    ox, oy = o[0] - x, o[1] - y
    a = d[:, 0] ** 2 + d[:, 1] ** 2
    b = ox * d[:, 0] + oy * d[:, 1]
    root = b * b - a * (ox * ox + oy * oy - radius * radius)
    t = (-b - np.sqrt(np.maximum(root, 0))) / a
    z = o[2] + t * d[:, 2]
    return np.where((root > 0) & (t > 0) & (z > 0) & (z < height), t, np.inf)


def _hit_bush(centre: Array, radius: float, o: Array, d: Array, rng: np.random.Generator) -> Array:
    b = d @ (centre - o)
    root = b * b - (np.sum((centre - o) ** 2) - radius**2)
    depth = np.sqrt(np.maximum(root, 0))
    t = b - depth + rng.exponential(radius, len(d))
    return np.where((root > 0) & (t > 0) & (t < b + depth), t, np.inf)
