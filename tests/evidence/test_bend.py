# SPDX-License-Identifier: MIT
"""A map that bends is told, and no pose of it is "ok"; one that does not bend stays what it is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from made_places import Made
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.deformation import bend
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.pair import Pair

Array = NDArray[np.float64]
# Where the drifting map puts a scan that was taken x metres along the way.
Drift = Callable[[float], Array]


def none(x: float) -> Array:
    return np.eye(4)


def arc(x: float) -> Array:
    """The way bends by ten degrees over 50 m."""
    bend = np.radians(10.0) / 50.0
    at = se3.yaw(np.degrees(bend * x))
    at[:3, 3] = np.sin(bend * x) / bend, (1.0 - np.cos(bend * x)) / bend, 0.0
    return at @ se3.from_rt(np.eye(3), np.array([-x, 0.0, 0.0]))


def kink(x: float) -> Array:
    """Four degrees from the middle on."""
    return se3.yaw(4.0) if x > 0.0 else np.eye(4)


def longer(x: float) -> Array:
    """The way is four per cent too long."""
    return se3.from_rt(np.eye(3), np.array([0.04 * x, 0.0, 0.0]))


def slip(x: float) -> Array:
    """Two metres aside from the middle on."""
    return se3.from_rt(np.eye(3), np.array([0.0, 2.0 if x > 0.0 else 0.0, 0.0]))


def sag(x: float) -> Array:
    """A metre at either end."""
    return se3.from_rt(np.eye(3), np.array([0.0, 0.0, (x / 25.0) ** 2]))


def mapped(world: box_world.World, begin: float, drift: Drift, seed: int) -> Array:
    """Eleven scans over 50 m in one frame."""
    rng = np.random.default_rng(seed)
    parts = []
    for x in begin + np.linspace(-25.0, 25.0, 11):
        frame = box_world.sensor_pose(x, rng.uniform(-0.3, 0.3), 1.8, rng.uniform(-20.0, 20.0))
        scan = box_world.scan(world, "rings16", frame, rng, density=0.4)
        scan = scan[np.linalg.norm(scan, axis=1) < 30.0]
        parts.append(se3.apply(drift(x) @ frame, scan))
    return voxel_centroids(np.concatenate(parts), 0.2)


def wood() -> box_world.World:
    """Trunks and bushes along 100 m."""
    world, rng = box_world.World(), np.random.default_rng(8)
    for _ in range(220):
        x, y = rng.uniform(-60.0, 60.0), rng.choice([-1.0, 1.0]) * rng.uniform(2.0, 30.0)
        world.posts.append((x, y, rng.uniform(0.1, 0.35), 9.0))
    for _ in range(40):
        x, y = rng.uniform(-60.0, 60.0), rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 30.0)
        world.bushes.append((np.array([x, y, rng.uniform(0.3, 4.0)]), rng.uniform(0.7, 2.0)))
    return world


def street() -> box_world.World:
    return box_world.street(np.random.default_rng(8))


@pytest.fixture(scope="module")
def plain() -> Array:
    return mapped(wood(), 3.0, none, 1)


@pytest.fixture(scope="module")
def along_houses() -> Array:
    return mapped(street(), 3.0, none, 1)


@pytest.mark.parametrize("drift", [longer, slip, sag])
def test_no_pose_of_a_drifting_street_is_ok(along_houses: Array, drift: Drift) -> None:
    bent = se3.apply(se3.yaw(70.0), mapped(street(), 0.0, drift, 2))
    result = hr.register(bent, along_houses, source_viewpoint="none", target_viewpoint="none")
    assert result.verdict != "ok"
    assert any("does a map drift or bend?" in reason for reason in result.reasons)


@pytest.mark.parametrize("drift", [arc, kink])
@pytest.mark.parametrize("turned", [False, True], ids=["source", "target"])
def test_no_pose_of_a_bent_map_is_ok(plain: Array, drift: Drift, turned: bool) -> None:
    bent = se3.apply(se3.yaw(70.0), mapped(wood(), 0.0, drift, 2))
    clouds = (plain, bent) if turned else (bent, plain)
    result = hr.register(*clouds, source_viewpoint="none", target_viewpoint="none")
    assert result.verdict != "ok"
    assert any("does a map drift or bend?" in reason for reason in result.reasons)


@pytest.mark.parametrize(("world", "target"), [(wood, "plain"), (street, "along_houses")])
def test_a_map_that_does_not_bend_is_ok(
    world: Callable[[], box_world.World], target: str, request: pytest.FixtureRequest
) -> None:
    source = se3.apply(se3.yaw(70.0), mapped(world(), 0.0, none, 2))
    other = request.getfixturevalue(target)
    result = hr.register(source, other, source_viewpoint="none", target_viewpoint="none")
    assert result.verdict == "ok"
    assert np.linalg.norm(result.transformation[:3, 3]) < 0.2


def test_a_scan_from_one_place_does_not_bend(
    crossing: Made, plain: Array, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise AssertionError("looked for a bend")

    monkeypatch.setattr(bend, "lying_better", fails)
    assert PoseEvidence(views.of(crossing.scene), crossing.truth).bend is None
    scene = VoxelGrid()(Pair.of(plain, plain, source_viewpoint="none", target_viewpoint="none"))
    with pytest.raises(AssertionError, match="looked for a bend"):
        _ = PoseEvidence(views.of(scene), np.eye(4)).bend
