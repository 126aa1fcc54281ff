# SPDX-License-Identifier: MIT
"""The recorded Predator agrees, and the runner takes any plan: recordings of our own network with others pass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stacked_recordings import backbone_plan, gradients, inputs, made_batch, true_points, unsettle, write

from hybridreg.learned.predator.graph import nearest_others
from hybridreg.learned.predator.losses import saliency_weight
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.official_names import official_name
from hybridreg.learned.predator.targets import compute_targets
from hybridreg.learned.pyramid.neighbors import pairs_within

THREE = ["simple", "resnetb_strided", "resnetb", "resnetb_strided"]
UP = ["nearest_upsample", "unary", "nearest_upsample", "last_unary"]


def plan(backbone: dict[str, Any], graph: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    voxel = backbone["voxel"]
    loss = {
        "positive_margin": 0.15,
        "negative_margin": 1.3,
        "positive_optimal": 0.12,
        "negative_optimal": 1.35,
        "log_scale": 12,
        "positive_radius": 0.8 * voxel,
        "positive_radius_slack": 0.002,
        "safe_radius": 2.4 * voxel,
        "overlap_radius": 1.4 * voxel,
        "matchability_radius": voxel,
        "max_points": 60,
        "w_circle": 0.9,
        "w_overlap": 1.2,
        "w_saliency": [0.0, 1.0],
    }
    return {
        **backbone,
        "final_dim": 12,
        "gnn": graph,
        "cross_score": True,
        "condition_feature": True,
        "temperature_floor": 0.03,
        "loss": loss,
        **changes,
    }


PLANS = {
    "three stages, no scores across": plan(
        backbone_plan(THREE + UP, 8, 9, 0.6),
        {"dim": 12, "k": 4, "heads": 2, "blocks": ["self", "cross", "self", "cross"]},
        cross_score=False,
        condition_feature=False,
    ),
    "four stages, simple blocks": plan(
        backbone_plan(
            [
                "simple",
                "simple_strided",
                "resnetb",
                "resnetb",
                "resnetb_strided",
                "resnetb",
                "resnetb_strided",
            ]
            + ["nearest_upsample", "unary", "unary", *UP],
            12,
            15,
            0.45,
        ),
        {"dim": 22, "k": 6, "heads": 1, "blocks": ["cross", "self"]},
        condition_feature=False,
    ),
    "two stages, no blocks": plan(
        backbone_plan(["simple", "resnetb", "resnetb_strided", "nearest_upsample", "last_unary"], 16, 5, 1.0),
        {"dim": 8, "k": 3, "heads": 8, "blocks": []},
        temperature_floor=0.1,
    ),
}


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network."""
    from recorded_predator import block_outputs, network_config

    torch.manual_seed(0)
    config = network_config(description)
    network = PredatorNetwork(config)
    unsettle(network)
    batch = made_batch(config)
    moved, target = true_points(batch)
    values = inputs(batch.pyramid, pairs_within(moved, target, config.loss.overlap_radius))
    targets = compute_targets(batch.pyramid, values["in.transform"], config, torch.Generator().manual_seed(0))
    with torch.no_grad():
        seen = block_outputs(network, batch)
    values |= {f"out.{name}": value for name, value in seen.items()}
    values["out.feats_first7"] = seen["feats"][:7]
    for side, cloud in zip(("ref", "src"), batch.pyramid.clouds(batch.pyramid.stages - 1), strict=True):
        values[f"out.gnn_knn.{side}"] = nearest_others(cloud, config.graph.neighbors).int()
    names = [official_name(name) for name, _ in network.named_parameters()]
    for weight in (0, 1):
        network.zero_grad()
        losses = network.losses(network(batch), targets)
        losses.weighed(float(weight)).backward()
        prefix = f"train.w_saliency_{weight}."
        values |= {f"{prefix}total": losses.weighed(float(weight))}
        values |= gradients(network, official_name, names, prefix)
        for place in (prefix, "loss.out."):
            values |= {f"{place}circle_loss": losses.circle, f"{place}recall": losses.recall}
            for name, part in (("overlap", losses.overlap), ("saliency", losses.saliency)):
                values |= {f"{place}{name}_loss": part.loss}
                values |= {f"{place}{name}_precision": part.precision, f"{place}{name}_recall": part.recall}
    values["loss.selected_correspondences"] = torch.stack([targets.drawn_source, targets.drawn_target], 1)
    values |= {"loss.overlap_labels": losses.overlap.labels, "loss.saliency_labels": losses.saliency.labels}
    values["loss.saliency_points_src"] = targets.source.unique()
    values["loss.saliency_points_ref"] = targets.target.unique()
    weights = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    write(stem, {**description, "train_grad_norm_names": names}, values, weights)


@pytest.mark.parametrize("name", PLANS)
def test_other_plans(tmp_path: Path, name: str) -> None:
    from run import main

    record(tmp_path / "made", PLANS[name])
    assert main([str(tmp_path / "made")]) == 0
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    for key, off in (("loss.out.overlap_loss", 1e-3), ("train.w_saliency_0.grad_norm", 1.0)):
        np.savez(tmp_path / "made.npz", **{**values, key: values[key] + np.float32(off)})
        assert main([str(tmp_path / "made")]) == 1, key
    np.savez(tmp_path / "made.npz", **values, **{"out.something": values["out.feats"]})
    assert main([str(tmp_path / "made")]) == 1, "an output that nobody compared"


def test_the_recording_agrees(recording_stem: Path) -> None:
    from run import main

    assert main([str(recording_stem.with_name("predator_kitti_mini"))]) == 0


@pytest.fixture(scope="module")
def small_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of our own network as it is."""
    stem: Path = tmp_path_factory.mktemp("small") / "made"
    record(stem, PLANS["three stages, no scores across"])
    return stem


@pytest.mark.parametrize("change", ["heads", "order", "norm", "scale"])
def test_what_one_would_guess_wrong_is_noticed(
    small_recording: Path, change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import recorded_predator

    from hybridreg.learned.layers import kpconv_blocks, message_attention
    from hybridreg.learned.predator import losses

    if change == "heads":

        def contiguous(self, features):  # type: ignore[no-untyped-def]
            return features.unflatten(-1, (self.heads, -1)).movedim(-2, -3)

        monkeypatch.setattr(message_attention.InterleavedAttention, "_split", contiguous)
    elif change == "order":

        def together(self, clouds, masks=(None, None)):  # type: ignore[no-untyped-def]
            source, target = clouds
            return source + self.layer(source, target), target + self.layer(target, source)

        monkeypatch.setattr(message_attention.MessageBlock, "forward", together)
    elif change == "norm":
        plain = kpconv_blocks.PointInstanceNorm.forward

        def per_cloud(self, features, lengths, slope=1.0):  # type: ignore[no-untyped-def]
            return torch.cat([plain(self, part, lengths, slope) for part in features.split(list(lengths))])

        monkeypatch.setattr(kpconv_blocks.PointInstanceNorm, "forward", per_cloud)
    else:
        circle = losses.circle
        monkeypatch.setattr(
            losses, "circle", lambda *a: circle(*a[:3], type("", (), {**vars(a[3]), "log_scale": 48.0}))
        )
    found = recorded_predator.compare(small_recording)
    assert any(not value <= tolerance for value, tolerance in found.values())


def test_the_saliency_loss_is_switched() -> None:
    assert [saliency_weight(recall) for recall in (0.0, 0.3, 0.31, 1.0)] == [0.0, 0.0, 1.0, 1.0]
