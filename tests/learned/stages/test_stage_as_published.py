# SPDX-License-Identifier: MIT
"""One switch runs the paper's matching, whatever the weights' configuration adds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.learned.cross3dreg.config import LgrConfig, NetworkConfig
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.stages.geotransformer import GeoTransformer
from hybridreg.learned.stages.lgr import Lgr
from hybridreg.learned.stages.omp import Omp
from hybridreg.learned.stages.vgam import Vgam
from hybridreg.matches import Correspondences, Overlap
from hybridreg.pair import Pair
from hybridreg.scene import Scene

Made = Callable[..., str]
Shifted = tuple[Pair, np.ndarray]


def with_ours(config: NetworkConfig) -> NetworkConfig:
    """A configuration with everything of ours switched on."""
    matching = replace(config.matching, vote_temperature=0.05, uniqueness=0.02, consistency=1.0)
    omp = None if config.omp is None else replace(config.omp, threshold=0.3, doubted=0.3)
    return replace(config, matching=matching, omp=omp)


def same(first: Correspondences, second: Correspondences) -> bool:
    return all(
        np.array_equal(getattr(first, name), getattr(second, name))
        for name in ("source", "target", "weight", "group")
    )


def masked(scene: Scene) -> Overlap:
    """A mask of three values, so that it matters where it is cut and whom it doubts."""
    rng = np.random.default_rng(0)
    return Overlap(*(rng.choice([0.2, 0.45, 0.9], len(level)) for level in (scene.source, scene.target)))


@pytest.mark.parametrize(("stage", "parts"), [(GeoTransformer, {}), (Vgam, {"omp": True, "vgam": True})])
def test_matching_as_published_leaves_out_what_is_ours(
    shifted: Shifted, make_weights: Made, stage: type, parts: dict[str, bool]
) -> None:
    plain = named_config("nano", **parts)
    bare, full = make_weights(plain, name="bare"), make_weights(with_ours(plain), name="full")
    scene = VoxelGrid(voxel=0.5)(shifted[0])
    overlap = masked(scene)
    printed = stage(weights=full, as_published=True)(scene, overlap)
    assert same(printed, stage(weights=bare)(scene, overlap))
    assert not same(printed, stage(weights=full)(scene, overlap))
    assert len(printed) > 0


def test_the_network_of_others_stays_as_it_was(shifted: Shifted, make_weights: Made) -> None:
    weights = make_weights(with_ours(named_config("nano")))
    scene = VoxelGrid(voxel=0.5)(shifted[0])
    everything = Overlap.full(len(scene.source), len(scene.target))
    before = GeoTransformer(weights=weights)(scene, everything)
    GeoTransformer(weights=weights, as_published=True, similarity="raw")(scene, everything)
    assert same(before, GeoTransformer(weights=weights)(scene, everything))


def test_raw_similarity_chooses_other_superpoints(shifted: Shifted, make_weights: Made) -> None:
    weights = make_weights(named_config("nano"))
    scene = VoxelGrid(voxel=0.5)(shifted[0])
    everything = Overlap.full(len(scene.source), len(scene.target))
    unit, raw = (
        GeoTransformer(weights=weights, as_published=True, similarity=kind)(scene, everything)
        for kind in ("unit", "raw")
    )
    assert len(raw) > 0
    assert not same(unit, raw)
    with pytest.raises(ValueError, match="similarity: expected one of .*'cosine'"):
        GeoTransformer(weights=weights, similarity="cosine")  # type: ignore[arg-type]


def test_a_mask_that_was_trained_with_more_says_so(shifted: Shifted, make_weights: Made) -> None:
    config = named_config("nano", omp=True, vgam=True)
    assert config.omp is not None
    more = replace(config, omp=replace(config.omp, cross_cloud=True, evidence=True))
    said = {}
    for name, each in (("as printed", config), ("more", more)):
        scene = VoxelGrid(voxel=0.5)(shifted[0])
        Omp(weights=make_weights(each, name=name), as_published=True)(scene)
        said[name] = [note for note in scene.notes if "not as published" in note]
    assert said["as printed"] == []
    assert "the other cloud and how alike its points are" in said["more"][0]


def test_lgr_takes_the_numbers_of_the_weights(make_weights: Made) -> None:
    config = replace(
        named_config("nano"), lgr=LgrConfig(acceptance_radius=1.7, min_group=4, steps=9, max_votes=500)
    )
    weights = make_weights(config)
    assert Lgr(weights=weights).config(0.8) == config.lgr
    assert Lgr(weights=weights, max_distance=0.4).config(0.8) == replace(config.lgr, acceptance_radius=0.4)
    assert Lgr().config(0.8) == LgrConfig(acceptance_radius=0.8)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        Lgr(weights="nowhere").config(0.8)


def test_lgr_refuses_weights_of_a_network_without_it(tmp_path_factory: pytest.TempPathFactory) -> None:
    from hybridreg.learned.network_table import network_class

    folder = tmp_path_factory.mktemp("omnet")
    torch.manual_seed(0)
    cls = network_class("omnet")
    cls.named(cls.sizes[0]).save_pretrained(folder)
    with pytest.raises(ValueError, match="no local-to-global"):
        Lgr(weights=str(folder)).config(1.0)


def test_the_preset_is_the_published_path_throughout() -> None:
    pipe = hr.Pipeline.preset("cross3dreg-as-published")
    assert pipe.overlap.as_published
    assert pipe.match.as_published
    assert pipe.estimate.config(0.8) == pipe.match.network().config.lgr
    assert pipe.to_spec()["refine"]["stage"] == "none"
    config = pipe.match.configured().config
    assert config.matching.vote_temperature is None
    assert config.matching.consistency is None
    assert config.omp is not None
    assert (config.omp.threshold, config.omp.doubted) == (0.5, 0.0)
