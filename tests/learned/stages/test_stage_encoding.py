# SPDX-License-Identifier: MIT
"""What a network sees of a scene, how often it looks, and what it tells of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

import hybridreg as hr
from hybridreg import testing
from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.network import Encoding, RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.stages.spreading import gather, spread
from hybridreg.matches import Overlap
from hybridreg.scene import Scene

MakeWeights = Callable[..., str]
CROSS = named_config("nano", omp=True, vgam=True)
OMP, VGAM = hr.Omp(untrained=True), hr.Vgam(untrained=True)


@pytest.fixture
def encodings(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows by the number of first-stage points whenever a network encodes a pair."""
    seen: list[int] = []
    encode = RegistrationNetwork.encode

    def counted(self: RegistrationNetwork, batch: object) -> Encoding:
        seen.append(len(batch.pyramid.points[0]))  # type: ignore[attr-defined]
        return encode(self, batch)  # type: ignore[arg-type]

    monkeypatch.setattr(RegistrationNetwork, "encode", counted)
    return seen


def full(scene: Scene) -> Overlap:
    return Overlap.full(len(scene.source), len(scene.target))


def scene_of(voxel: float, *, image: bool = True, seed: int = 0) -> Scene:
    pair, _ = testing.sample_pair(seed, n_points=1500)
    return hr.VoxelGrid(voxel=voxel)(pair if image else dataclasses.replace(pair, image=None))


def test_omp_and_vgam_look_once(encodings: list[int]) -> None:
    scene = scene_of(0.5)
    VGAM(scene, OMP(scene))
    assert len(encodings) == 1
    VGAM(scene_of(0.5), full(scene))
    assert len(encodings) == 2, "another run may not see the pair of the last one"


def test_other_weights_look_for_themselves(encodings: list[int], make_weights: MakeWeights) -> None:
    scene = scene_of(0.5)
    one, two = make_weights(CROSS, name="one"), make_weights(named_config("nano"), name="two")
    overlap = hr.Omp(weights=one)(scene)
    hr.Vgam(weights=one)(scene, overlap)
    hr.GeoTransformer(weights=two)(scene, overlap)
    assert len(encodings) == 2


@pytest.mark.parametrize("image", [True, False])
@pytest.mark.parametrize("voxel", [0.5, 0.3])
def test_stages_in_a_row_are_the_network(make_weights: MakeWeights, voxel: float, image: bool) -> None:
    scene = scene_of(voxel, image=image)
    folder = make_weights(CROSS)
    stage = hr.Vgam(weights=folder)
    found = stage(scene, hr.Omp(weights=folder)(scene))
    same = voxel == CROSS.backbone.voxel
    source, target = (scene.source, scene.target) if same else (scene.pair.source, scene.pair.target)
    batch = make_batch(target.points, source.points, CROSS, image=scene.pair.image, subsample=not same)
    with torch.inference_mode():
        whole = stage.network()(batch).matches
    assert np.array_equal(found.weight, whole.weight.double().numpy())
    assert np.array_equal(found.source, whole.source.double().numpy())
    assert np.array_equal(found.group, whole.group.numpy())


def test_levels_of_the_networks_voxel_are_taken_as_they_are(encodings: list[int]) -> None:
    scene = scene_of(0.5)
    VGAM(scene, full(scene))
    assert encodings == [len(scene.source) + len(scene.target)]
    assert not [note for note in scene.notes if "voxel" in note]


@pytest.mark.parametrize(("voxel", "doubt"), [(0.3, False), (0.2, True), (1.2, True)])
def test_another_voxel_is_told_with_its_numbers(voxel: float, doubt: bool) -> None:
    scene = scene_of(voxel)
    VGAM(scene, full(scene))
    (note,) = [note for note in scene.notes if "voxel" in note]
    assert "voxel of 0.5 m" in note
    assert f"{voxel} m" in note
    assert ("size that the network was trained for?" in note) == doubt


def test_the_networks_grid_does_not_hang_on_the_levels(encodings: list[int]) -> None:
    for voxel in (0.3, 1.2):
        scene = scene_of(voxel)
        VGAM(scene, full(scene))
    assert encodings[0] == encodings[1]


def test_without_an_image_omp_says_that_it_knows_nothing() -> None:
    scene = scene_of(0.5, image=False)
    overlap = OMP(scene)
    assert (overlap.source == 1.0).all()
    assert any("every point takes part" in note for note in scene.notes)
    assert len(VGAM(scene, overlap))


def test_omp_that_sees_the_other_cloud_needs_no_image(make_weights: MakeWeights) -> None:
    assert CROSS.omp is not None
    config = dataclasses.replace(CROSS, omp=dataclasses.replace(CROSS.omp, cross_cloud=True))
    scene = scene_of(0.5, image=False)
    overlap = hr.Omp(weights=make_weights(config))(scene)
    assert overlap.source.std() > 0.0


def test_a_mask_that_leaves_too_little_is_told() -> None:
    scene = scene_of(0.5)
    low = Overlap(np.linspace(0.0, 0.4, len(scene.source)), np.ones(len(scene.target)))
    assert len(VGAM(scene, low))
    (note,) = [note for note in scene.notes if "mask_fallback" in note]
    assert note.startswith("source: ")
    assert "mask_fallback=topk" in note
    patient = dataclasses.replace(VGAM, min_overlap=0.0)
    scene = scene_of(0.5)
    patient(scene, low)
    assert not [note for note in scene.notes if "mask_fallback" in note]


def test_the_cap_on_superpoints_is_told(make_weights: MakeWeights) -> None:
    matching = dataclasses.replace(CROSS.matching, max_superpoints=20)
    stage = hr.Vgam(weights=make_weights(dataclasses.replace(CROSS, matching=matching)))
    scene = scene_of(0.5)
    stage(scene, full(scene))
    told = [note for note in scene.notes if "(max_superpoints)" in note]
    assert [note.partition(":")[0] for note in told] == ["target", "source"]
    assert all(": 20 of " in note for note in told)


def test_the_order_of_a_levels_points_does_not_matter() -> None:
    scene = scene_of(0.5)
    order = np.random.default_rng(0).permutation(len(scene.source))
    level = dataclasses.replace(scene.source, points=scene.source.points[order])
    shuffled = dataclasses.replace(scene, source=level, notes=[], _shared={})
    assert np.allclose(OMP(scene).source[order], OMP(shuffled).source, atol=1e-4)


@given(st.integers(1, 60), st.integers(1, 300), st.integers(0, 10**6))
def test_a_spread_mask_comes_back(n_nodes: int, n_points: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    nodes, points = rng.uniform(-20, 20, (n_nodes, 3)), rng.uniform(-20, 20, (n_points, 3))
    mask = rng.random(n_nodes).astype(np.float32).astype(np.float64)
    on_points = spread(mask, nodes, points)
    distance = np.linalg.norm(points[:, None] - nodes[None], axis=2)
    owner = distance.argmin(axis=1)
    assert np.array_equal(on_points, mask[owner])
    back = gather(on_points, points, nodes)
    owning = np.isin(np.arange(n_nodes), owner)
    assert np.array_equal(back[owning], mask[owning])
    nearest = distance.argmin(axis=0)
    assert np.array_equal(back[~owning], on_points[nearest[~owning]])


def test_a_superpoint_takes_the_mean_of_its_points() -> None:
    nodes = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    assert gather(np.array([0.2, 0.6, 1.0]), points, nodes) == pytest.approx([0.4, 1.0])
