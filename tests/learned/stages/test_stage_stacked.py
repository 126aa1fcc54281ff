# SPDX-License-Identifier: MIT
"""Predator and CoFiNet as stages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg import registry, testing
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.official_names import official_name
from hybridreg.learned.stages.drawing import draw
from hybridreg.matches import Overlap

STAGES = [hr.PredatorOverlap(untrained=True), hr.Predator(untrained=True), hr.Cofinet(untrained=True)]


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: type(stage).__name__)
def test_the_suite(stage: Any, check: testing.stages.Check) -> None:
    check(stage, testing.slot_of(stage))


def test_all_are_registered_under_their_names() -> None:
    names = ["overlap.predator", "match.predator", "match.cofinet"]
    assert [registry.name_of(stage) for stage in STAGES] == names


@pytest.fixture
def weights(tmp_path: Path) -> dict[str, str]:
    """Folders of weights that look trained."""
    folders = {}
    for cls in (PredatorNetwork, CofinetNetwork):
        torch.manual_seed(5)
        network = cls(cls.named_config("nano"))
        with torch.no_grad():
            for parameter in network.parameters():
                parameter += 0.02 * torch.randn_like(parameter)
        folders[cls.name] = str(tmp_path / cls.name)
        network.save_pretrained(folders[cls.name])
    return folders


def test_random_weights_run_only_where_asked(tmp_path: Path) -> None:
    for cls in (hr.Predator, hr.PredatorOverlap, hr.Cofinet):
        with pytest.raises(ValueError, match="insist with untrained=True"):
            cls(size="nano")
        assert cls().weights in ("predator-small", "cofinet-small")  # what comes with the package
    PredatorNetwork(PredatorNetwork.named_config("nano")).save_pretrained(tmp_path / "raw")
    with pytest.raises(ValueError, match=r"random: encoder of .*raw' was never trained"):
        hr.Predator.from_pretrained(tmp_path / "raw")
    scene, _ = testing.sample_scene()
    hr.Predator(size="nano", untrained=True)(scene, Overlap.full(len(scene.source), len(scene.target)))
    assert any("Predator ran with random weights" in note for note in scene.notes)


def test_trained_weights(weights: dict[str, str], tmp_path: Path) -> None:
    scene, _ = testing.sample_scene()
    stage = hr.Cofinet.from_pretrained(weights["cofinet"])
    found = stage(scene, Overlap.full(len(scene.source), len(scene.target)))
    assert not any("random" in note for note in scene.notes)
    assert found.group is not None
    assert found.spacing == 0.5
    stage.save_pretrained(tmp_path / "again")
    other, _ = testing.sample_scene()
    again = hr.Cofinet.from_pretrained(tmp_path / "again")
    assert np.array_equal(
        again(other, Overlap.full(len(other.source), len(other.target))).source, found.source
    )
    with pytest.raises(ValueError, match="weights of the network 'cofinet', not of 'predator'"):
        hr.Predator.from_pretrained(weights["cofinet"])
    with pytest.raises(ValueError, match="have their own configuration"):
        hr.Predator.from_pretrained(weights["predator"], size="nano")


def test_a_published_checkpoint_is_a_stage(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = PredatorNetwork(PredatorNetwork.named_config("predator-3dmatch"))
    with torch.no_grad():
        network.score.bias += 0.1
    state = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    torch.save({"state_dict": state}, tmp_path / "indoor.pth")
    stage = hr.Predator.load_official(tmp_path / "indoor.pth")
    assert stage.network().config.backbone.voxel == 0.025
    named = hr.PredatorOverlap.load_official(tmp_path / "indoor.pth", size="predator-3dmatch")
    assert named.network().config == stage.network().config
    with pytest.raises(ValueError, match="has shape"):
        hr.Predator.load_official(tmp_path / "indoor.pth", size="predator-kitti")


def test_overlap_and_matcher_share_one_pass(weights: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    passes = []
    forward = PredatorNetwork.forward
    monkeypatch.setattr(
        PredatorNetwork, "forward", lambda self, batch: passes.append(1) or forward(self, batch)
    )
    scene, _ = testing.sample_scene()
    overlap = hr.PredatorOverlap(weights=weights["predator"])(scene)
    hr.Predator(weights=weights["predator"])(scene, overlap)
    assert len(passes) == 1
    assert overlap.source.std() > 0.0


def test_a_given_overlap_takes_the_place_of_the_networks_own(weights: dict[str, str]) -> None:
    scene, _ = testing.sample_scene()
    half = Overlap(
        (scene.source.points[:, 0] > 0).astype(float), (scene.target.points[:, 0] > 0).astype(float)
    )
    found = hr.Predator(weights=weights["predator"])(scene, half)
    assert len(found) > 100
    assert found.source[:, 0].min() > -1.0
    assert found.target[:, 0].min() > -1.0
    other, _ = testing.sample_scene()
    matched = hr.Cofinet(weights=weights["cofinet"])(other, half)
    assert len(matched)
    assert matched.source[:, 0].min() > -4.0, "superpoints of 2 m cells"


def test_points_are_drawn_by_overlap_and_saliency(weights: dict[str, str]) -> None:
    scene, _ = testing.sample_scene()
    full = Overlap.full(len(scene.source), len(scene.target))
    stages = [hr.Predator(weights=weights["predator"], points=150, seed=seed) for seed in (0, 0, 1)]
    one, same, other = (stage(scene, full) for stage in stages)
    assert len(one) == 150
    assert np.array_equal(one.source, same.source)
    assert not np.array_equal(one.source, other.source)
    mutual = hr.Predator(weights=weights["predator"], points=150, mutual=True)(scene, full)
    assert 0 < len(mutual) < 150
    assert len(hr.Cofinet(weights=weights["cofinet"], matches=30)(scene, full)) == 30


@pytest.mark.parametrize("cls", [hr.Predator, hr.Cofinet])
def test_numbers_that_cannot_be_are_refused(cls: Any) -> None:
    name = "points" if cls is hr.Predator else "matches"
    with pytest.raises(ValueError, match=f"{name}=0 must be at least 1"):
        cls(untrained=True, **{name: 0})
    with pytest.raises(ValueError, match="seed=-1 must not be negative"):
        cls(untrained=True, seed=-1)


def test_too_large_a_pair_is_refused(weights: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    from hybridreg.learned import memory_estimate

    monkeypatch.setattr(memory_estimate, "available_bytes", lambda device: 10**6)
    scene, _ = testing.sample_scene()
    for stage in (hr.PredatorOverlap(weights=weights["predator"]), hr.Cofinet(weights=weights["cofinet"])):
        arguments = (
            ()
            if isinstance(stage, hr.PredatorOverlap)
            else (Overlap.full(len(scene.source), len(scene.target)),)
        )
        with pytest.raises(ValueError, match=r"GB are free: use weights with a voxel larger than 0.5 m"):
            stage(scene, *arguments)


def test_draws_follow_the_weights() -> None:
    weight = np.array([0.0, 1.0, 3.0, 0.0, 1.0])
    assert draw(weight, 3, 0).tolist() == [1, 2, 4]
    assert draw(weight, 9, 0).tolist() == [1, 2, 4]
    assert draw(np.zeros(3), 2, 0).tolist() == []
    firsts = np.array([draw(weight, 1, seed)[0] for seed in range(500)])
    assert np.bincount(firsts, minlength=5)[[1, 2, 4]] / 500 == pytest.approx([0.2, 0.6, 0.2], abs=0.07)


def test_random_weights_find_a_shift_on_the_grid(shifted: Any) -> None:
    pair, truth = shifted
    for match in (STAGES[1], STAGES[2]):
        pipe = hr.Pipeline(voxel=0.5, match=match, estimate="ransac", refine="none")
        found = pipe.run(pair).transformation
        assert np.abs(found - truth).max() < 0.3, type(match).__name__
