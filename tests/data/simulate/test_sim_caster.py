# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.data.simulate.sensing import caster
from hybridreg.data.simulate.sensing.caster import EmbreexCaster, Open3dCaster, Part, World
from hybridreg.data.simulate.world.mesh import EMPTY, Mesh
from hybridreg.data.simulate.world.solids import boxes, tubes


def unit(rows: np.ndarray) -> np.ndarray:
    return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


def cube(x: float, material: str = "brick") -> Mesh:
    return boxes(np.array([[x, 0, -1.0]]), np.array([2.0, 2.0, 2.0]), 0.0, material, (0.1, 0.2, 0.3))


@pytest.fixture
def rays() -> np.ndarray:
    return unit(np.random.default_rng(0).normal(size=(2000, 3)))


def test_distances_are_those_of_a_box_by_hand(rays: np.ndarray) -> None:
    world = World([Part(cube(5.0))])
    hits = world.cast(np.zeros(3), rays)
    # Slab method: the ray enters where its last slab is entered.
    with np.errstate(divide="ignore"):
        a, b = np.array([4, -1, -1]) / rays, np.array([6, 1, 1]) / rays
    enter, leave = np.minimum(a, b).max(1), np.maximum(a, b).min(1)
    expected = np.where((enter <= leave) & (enter > 0), enter, np.inf)
    agree = np.isclose(hits.distance, expected, atol=1e-4)
    assert np.isfinite(expected).sum() > 30
    assert agree.mean() > 0.999  # float32 edges
    solid = np.isfinite(hits.distance)
    assert (np.einsum("ij,ij->i", hits.normal, rays)[solid] < 0).all()
    np.testing.assert_allclose(
        world.tint[hits.face[solid]], np.tile([0.1, 0.2, 0.3], (solid.sum(), 1)), atol=1e-6
    )
    assert (hits.face[~solid] == -1).all()


def test_nearer_part_hides_the_farther_one(rays: np.ndarray) -> None:
    ahead = unit(np.array([[1.0, 0, 0.01]]))
    near, far = cube(5.0, "glass"), cube(9.0, "brick")
    for parts in ([near, far], [far, near]):
        world = World([Part(p) for p in parts])
        hits = world.cast(np.zeros(3), ahead)
        assert hits.distance[0] == pytest.approx(4.0, abs=0.01)
        assert hits.material[0] == near.material[0]
        assert world.clear(np.zeros(3), 3.9 * ahead).all()
        assert not world.clear(np.zeros(3), 4.1 * ahead).any()


def test_a_world_may_have_no_movers(rays: np.ndarray) -> None:
    alone, with_empty = World([Part(cube(5.0))]), World([Part(cube(5.0)), Part(EMPTY)])
    np.testing.assert_array_equal(
        alone.cast(np.zeros(3), rays).distance, with_empty.cast(np.zeros(3), rays).distance
    )


def test_open3d_and_embreex_agree(rays: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    start = rng.uniform(-10, 10, (40, 3))
    mesh = Mesh.merge(
        [cube(5.0), tubes(start, start + rng.normal(size=(40, 3)) * 3, 0.3, 0.1, "bark", (0, 0, 0))]
    )
    rays = np.concatenate([np.zeros_like(rays), rays], axis=1)
    casters = EmbreexCaster(mesh), Open3dCaster(mesh)
    (t_one, face_one), (t_other, face_other) = (caster.cast(rays) for caster in casters)
    # What is drawn must not hang on which of the two a machine has. To the bit they agree only where both choose code
    # for the same vector units: one of them may know wider ones than the other.
    assert np.isclose(t_one, t_other, rtol=1e-6, atol=0.0).mean() > 0.999
    assert (face_one == face_other).mean() > 0.999
    assert face_one.dtype == face_other.dtype == np.int32
    assert (face_one == -1).any()
    assert np.isinf(t_one[face_one == -1]).all()
    rays[:, 3:] *= 8.0
    one, other = (caster.blocked(rays) for caster in casters)
    assert (one == other).mean() > 0.999
    assert 0 < one.sum() < (face_one >= 0).sum()


def test_without_open3d_embreex_serves_and_without_both_the_cure_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing(_: Mesh) -> None:
        raise ImportError("no such wheel")

    monkeypatch.setattr(caster, "Open3dCaster", missing)
    assert isinstance(caster.make_caster(cube(1.0)), EmbreexCaster)
    monkeypatch.setattr(caster, "EmbreexCaster", missing)
    with pytest.raises(ImportError, match="pip install embreex"):
        caster.make_caster(cube(1.0))
