# SPDX-License-Identifier: MIT
"""Overlap of two scans: measured on clouds, and estimated beforehand from a few rays."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from hybridreg.data.simulate.sensing.caster import World
from hybridreg.data.simulate.sensing.patterns import pattern
from hybridreg.data.simulate.sensing.sensors import Sensor

RADIUS = 0.5  # metres; the definition that the real pairs' figures use


def thin(points: np.ndarray, voxel: float) -> np.ndarray:
    """One measured point (the first) of each occupied voxel of edge `voxel`, voxel after voxel: it compresses well."""
    return points[first_of_cubes(points, voxel)] if len(points) else points


def first_of_cubes(points: np.ndarray, voxel: float) -> np.ndarray:
    """Index (m,) of the first point in each occupied voxel, voxel after voxel."""
    cells = [_cells(points[:, k], voxel) for k in range(3)]
    n, span = len(points), [int(cell.max()) + 1 for cell in cells]
    if span[0] * span[1] * span[2] * n >= 2**63:
        raise ValueError(f"voxel={voxel} m is too fine for a cloud of {span} cubes")
    x, y, z = (cell.astype(np.int64) for cell in cells)
    # Cube and point in one number: sorting numbers is several times as fast as sorting an index by them.
    tagged = np.sort(((x * span[1] + y) * span[2] + z) * n + np.arange(n))
    cube = tagged // n
    first = np.flatnonzero(np.r_[True, cube[1:] != cube[:-1]])
    return np.asarray(tagged[first] - cube[first] * n)


def _cells(coordinate: np.ndarray, voxel: float) -> np.ndarray:
    """Number (n,) of the cube along one axis, from zero."""
    cell = np.floor(coordinate / voxel)
    cell -= cell.min()
    return cell


def overlap(
    source: np.ndarray, target: np.ndarray, T_target_source: np.ndarray, radius: float = RADIUS
) -> float:
    """Share of `source` (N,3) with a point of `target` (M,3) within `radius` metres under the transform."""
    if len(source) == 0 or len(target) == 0:
        return 0.0
    moved = source @ T_target_source[:3, :3].T + T_target_source[:3, 3]
    low, high = moved.min(axis=0) - radius, moved.max(axis=0) + radius
    inside = [(target[:, k] >= low[k]) & (target[:, k] <= high[k]) for k in range(3)]
    near = target[inside[0] & inside[1] & inside[2]]
    # A tree that is not balanced is built three times as fast and queried nearly as fast.
    tree = cKDTree(near, balanced_tree=False, compact_nodes=False)
    distance, _ = tree.query(moved, distance_upper_bound=radius)
    return float(np.isfinite(distance).mean())


def expected_overlap(
    world: World, source: Sensor, target: Sensor, T_world_source: np.ndarray, T_world_target: np.ndarray
) -> float:
    """An estimate of `overlap` from some hundred rays: the share of the source's hits that the target's beams reach."""
    directions = _few_directions(source) @ T_world_source[:3, :3].T.astype(np.float32)
    hits = world.cast(T_world_source[:3, 3], directions)
    seen = (hits.distance > source.range_min) & (hits.distance < source.range_10)
    if seen.sum() < 30:
        return 0.0
    points = T_world_source[:3, 3] + hits.distance[seen, None] * directions[seen]
    # One vote per cube, like the measured figure on thinned clouds.
    first = first_of_cubes(points, 0.5)
    points, normals = points[first], hits.normal[seen][first]
    ray = points - T_world_target[:3, 3]
    distance = np.linalg.norm(ray, axis=1)
    ray /= distance[:, None]
    reached = _near_a_beam(
        target, ray @ T_world_target[:3, :3], distance, np.abs(np.sum(normals * ray, axis=1))
    )
    clear = world.clear(T_world_target[:3, 3], ray * (distance - 0.3)[:, None])
    return float((reached & clear).mean())


@lru_cache(maxsize=16)
def _few_directions(sensor: Sensor, rays: int = 700) -> np.ndarray:
    directions = pattern(sensor, np.random.default_rng(0))
    return directions[:: max(1, len(directions) // rays)]


def _near_a_beam(sensor: Sensor, ray: np.ndarray, distance: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    elevation = np.degrees(np.arcsin(np.clip(ray[:, 2], -1, 1)))
    if sensor.elevations_deg:
        gap = np.abs(elevation[:, None] - np.array(sensor.elevations_deg)).min(axis=1)
    else:
        azimuth = np.degrees(np.arctan2(ray[:, 1], ray[:, 0]))
        gap = np.maximum(
            np.abs(azimuth) - sensor.fov_deg[0] / 2, np.abs(elevation) - sensor.fov_deg[1] / 2
        ).clip(0)
    # Along a slanted surface the next ring is farther away than across the beam.
    near = np.radians(gap) * distance / np.clip(cosine, 0.05, 1) < RADIUS
    return near & (distance < sensor.range_10 * 1.2) & (distance > sensor.range_min)
