# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.data.simulate.sensing.stands import free_place
from hybridreg.data.simulate.world.layout import Layout
from hybridreg.data.simulate.world.materials import MATERIALS
from hybridreg.data.simulate.world.mesh import Mesh
from hybridreg.data.simulate.world.scenes import DEGENERATE, SCENES, USUAL


@pytest.fixture(scope="module", params=SCENES)
def layout(request: pytest.FixtureRequest) -> Layout:
    return SCENES[request.param](np.random.default_rng(5))


def test_meshes_are_sound(layout: Layout) -> None:
    mesh = Mesh.merge([*layout.still, *layout.at_source, *layout.at_target])
    assert np.isfinite(mesh.vertices).all()
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)
    assert mesh.material.max() < len(MATERIALS)
    assert len(mesh.faces) == len(mesh.material) == len(mesh.tint)
    assert mesh.tint.min() >= 0
    assert len(mesh.faces) < 90_000  # the ray caster's build time is what bounds pairs a second


def test_ground_has_a_material_everywhere_and_is_not_flat(layout: Layout) -> None:
    x, y = np.meshgrid(np.linspace(-100, 100, 41), np.linspace(-100, 100, 41))
    material = layout.surface(x, y)
    assert material.shape == x.shape
    assert {MATERIALS[i].name for i in np.unique(material)} <= {
        "asphalt",
        "paving",
        "grass",
        "meadow",
        "soil",
        "gravel",
    }
    assert layout.terrain.height(x, y).std() > 0.02


def test_sensors_find_room_to_stand(layout: Layout) -> None:
    rng = np.random.default_rng(0)
    found = [layout.free(free_place(layout, 0.8, rng), 0.8) for _ in range(10)]
    assert np.mean(found) >= 0.8


def test_same_seed_same_scene_other_seed_other_scene(layout: Layout) -> None:
    kind = next(k for k, make in SCENES.items() if _same(make(np.random.default_rng(5)), layout))
    assert not _same(SCENES[kind](np.random.default_rng(6)), layout)


def _same(one: Layout, other: Layout) -> bool:
    a, b = Mesh.merge(one.still), Mesh.merge(other.still)
    return a.vertices.shape == b.vertices.shape and bool((a.vertices == b.vertices).all())


def test_chances_name_known_scenes() -> None:
    assert set(USUAL) | set(DEGENERATE) == set(SCENES)


def test_things_move_between_the_scans() -> None:
    layout = SCENES["street"](np.random.default_rng(8))
    before, after = Mesh.merge(layout.at_source), Mesh.merge(layout.at_target)
    assert len(before.faces) > 0
    assert len(after.faces) > 0
    assert not (
        before.vertices.shape == after.vertices.shape and np.allclose(before.vertices, after.vertices)
    )


def test_nothing_is_put_where_something_stands() -> None:
    layout = SCENES["open_field"](np.random.default_rng(0))
    thing = Mesh.merge([])
    here = np.array([3.0, 4.0])
    assert layout.put(thing, here, 0.0, (1.0, 0.5))
    assert not layout.put(thing, here + [1.2, 0], 0.0, (0.5, 0.5))
    assert not layout.put_mover(thing, here - [20, 0], 0.0, np.array([20.0, 0.0]), (0.5, 0.5))
    assert layout.put(thing, here + [0, 5.0], 0.0, (0.5, 0.5))
