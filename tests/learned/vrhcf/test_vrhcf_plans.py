# SPDX-License-Identifier: MIT
"""The comparison takes any plan: recordings of our own network and estimator with other plans pass, end to end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from streets import street
from torch.nn import functional as F

from hybridreg.classical.hcf.compatibility import first_order, leading_eigenvectors, pick_seeds, second_order
from hybridreg.classical.hcf.consensus_sets import filter_sets, first_sets, set_poses, set_weights
from hybridreg.geometry import se3
from hybridreg.learned.vrhcf.batch import SphereBatch, make_batch
from hybridreg.learned.vrhcf.keypoint_matching import match_descriptors
from hybridreg.learned.vrhcf.losses import distances, hardest_in_batch
from hybridreg.learned.vrhcf.network import SphereNet
from hybridreg.learned.vrhcf.official_names import UNUSED, official_names
from hybridreg.learned.vrhcf.spherical_voxels import counts, spherical
from hybridreg.learned.vrhcf.upright_frames import reference_axes

Values = dict[str, Any]


def layer(width: int, kernel: int, dilation: int, norm: bool = True, relu: bool = True) -> dict[str, Any]:
    return {"width": width, "kernel": kernel, "dilation": dilation, "norm": norm, "relu": relu}


def plan(
    grid: tuple[int, int, int], shells: list[list[int]], surface: list[dict[str, Any]], **fields: Any
) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    descriptor = {
        "radius": 2.0,
        "radial": grid[0],
        "azimuth": grid[1],
        "elevation": grid[2],
        "interpolation": True,
        "local_frame": "3DMatch",
        "points_per_patch": 40,
        "batch": 4,
        "conv3d": shells,
        "conv2d": surface,
    }
    hcf = {
        "inlier_threshold": 0.5,
        "d_thre": 0.4,
        "num_iterations": 7,
        "ratio": 0.3,
        "nms_radius": 0.7,
        "max_points": 8000,
        "k": 60,
        "filter_ratio": 0.6,
        "final_k": 10,
    }
    return {
        "descriptor": {**descriptor, **fields},
        "loss": {"positive_margin": 0.2, "negative_margin": 1.1},
        "hcf": hcf,
        "refinement": {
            "iterations": 5,
            "threshold_if_inlier_threshold_is_0_10": 0.1,
            "threshold_otherwise": 0.9,
        },
    }


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network and estimator."""
    from recorded_vrhcf import network_config
    from vrhcf_estimator import stage_of

    network = SphereNet(network_config(description))
    generator = torch.Generator().manual_seed(0)
    for name, tensor in network.state_dict().items():
        if name.endswith("running_var"):
            tensor.copy_(0.5 + torch.rand(tensor.shape, generator=generator))
    network.eval()
    rows = np.arange(0, 700, 30)[:19]  # a rest of three, in batches of four
    cloud = street(0, 800, 6.0)
    batch = make_batch(cloud, cloud + [0.1, 0.0, 0.0], network.config, keypoints=(rows, rows))
    values: Values = {}
    with torch.no_grad():
        for side, patches in (("src", batch.source), ("tgt", batch.target)):
            values[f"in.{side}_patches"] = patches
            values[f"out.{side}.descriptors"] = network.describe(patches)
            if network.config.local_frame == "axis":
                values[f"out.{side}.z_axis"] = reference_axes(patches - patches[:, -1:], patches[:, -1])
                values[f"out.{side}.rotation"] = network.rotations(patches)
        values |= _steps(network, batch.source)
    units = [F.normalize(values[f"out.{side}.descriptors"], dim=1) for side in ("src", "tgt")]
    margins = network.config.positive_margin, network.config.negative_margin
    made = hardest_in_batch(units[0][:6], units[1][:6], *margins)
    values |= {"out.loss_first6": made.total, "out.accuracy_first6": 100.0 * made.accuracy}
    values["out.loss_distances_first6"] = distances(units[0][:6], units[1][:6])
    raw = values["out.src.descriptors"], values["out.tgt.descriptors"]
    values["match.out.raw"] = match_descriptors(*raw, "channels")
    values["match.out.unit"] = match_descriptors(units[0], units[1], "channels")
    values |= _estimates(stage_of("hcf", description))
    weights = {
        f"w.{official_names(network)[name]}": t.numpy().copy() for name, t in network.state_dict().items()
    }
    weights |= {f"w.{name}": np.zeros(1, np.float32) for name in UNUSED}
    np.savez(stem.with_name(f"{stem.name}_weights.npz"), **weights)
    values |= _training(network, batch, margins)
    np.savez(
        stem.with_name(f"{stem.name}.npz"), **{name: np.asarray(value) for name, value in values.items()}
    )
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(description))


def _steps(network: SphereNet, patches: torch.Tensor) -> Values:
    config = network.config
    local = network.local_points(patches[:5])
    x = network.voxelise(local)
    hard = counts(spherical(local), config.radius, (config.radial, config.azimuth, config.elevation))
    values = {
        "out.src.local_points_first5": local,
        "out.src.spherical_first5": spherical(local),
        "out.src.voxels_hard_first5": hard,
        "out.src.voxels_first5": x,
    }
    x = x[:1]
    for index, one in enumerate(network.layers):
        x = network.flattened(index, x)
        values[f"out.src.conv{index}_first1"] = one.convolved(x)
        x = one(x)
    return values


def _training(network: SphereNet, batch: SphereBatch, margins: tuple[float, float]) -> Values:
    network.train()
    output = network(SphereBatch(target=batch.target[:7], source=batch.source[:7]))
    units = F.normalize(output.source, dim=1), F.normalize(output.target, dim=1)
    made = hardest_in_batch(*units, *margins)
    made.total.backward()
    weight = network.layers[-1].conv.weight
    name = official_names(network)[f"layers.{len(network.layers) - 1}.conv.weight"]
    return {
        "train.out.src_descriptors": units[0].detach(),
        "train.out.tgt_descriptors": units[1].detach(),
        "train.out.loss": made.total.detach(),
        "train.out.accuracy": 100.0 * made.accuracy,
        "train.out.conv_net.ops.1.running_mean": network.layers[0].norm.running_mean,
        f"train.grad.{name}": weight.grad,
    }


def _estimates(stage: Any) -> Values:
    rng = np.random.default_rng(0)
    source = rng.uniform(-10, 10, (150, 3))
    truth = se3.from_rt(se3.random_rotation(rng), np.array([1.0, 2.0, 3.0]))
    target = se3.apply(truth, source) + rng.normal(0, 0.05, source.shape)
    target[60:] = rng.uniform(-10, 10, (90, 3))
    source, target = (cloud.astype(np.float32).astype(np.float64) for cloud in (source, target))
    soft = first_order(source, target, stage.reach)
    vector, first_count = leading_eigenvectors(soft[None], stage.iterations)
    seeds = pick_seeds(source, vector[0], stage.nms_radius, int(len(source) * stage.seed_share))
    agreement = second_order(soft, seeds.rows)
    sets = first_sets(agreement, stage.set_size)
    values: Values = {"hcf.out.stage0_sets": sets}
    for number, step in enumerate(filter_sets(soft, sets, stage.kept_share, stage.final_size), start=1):
        values |= {f"hcf.out.stage{number}_sets": step.sets, f"hcf.out.stage{number}_scores": step.scores}
        sets = step.sets
    weights, second_count = set_weights(soft, sets, stage.iterations)
    poses = set_poses(source, target, sets, weights)
    votes = np.array(
        [(np.linalg.norm(se3.apply(T, source) - target, axis=1) < stage.max_distance).sum() for T in poses]
    )
    steps = stage.refinement(source, target, poses[votes.argmax()], stage.refine_distance)
    return values | {
        "hcf.in.src": source.astype(np.float32),
        "hcf.in.tgt": target.astype(np.float32),
        "hcf.out.sc_measure_first9": soft[:9],
        "hcf.out.leading_eigenvector": vector[0],
        "hcf.out.power_iterations": np.array([first_count, second_count]),
        "hcf.out.local_maxima": seeds.is_peak,
        "hcf.out.seeds": seeds.rows,
        "hcf.out.sc2_first9": agreement[:9].astype(np.int16),
        "hcf.out.final_weights": weights,
        "hcf.out.seed_transforms": poses,
        "hcf.out.seed_inliers": votes,
        "hcf.out.best_seed": np.array(votes.argmax()),
        "hcf.out.coarse_transform": poses[votes.argmax()],
        "hcf.out.refine_counts": np.array([count for count, _ in steps]),
        "hcf.out.refine_transforms": np.array([T for _, T in steps]),
        "hcf.out.transform": steps[-1][1],
        "hcf.out.labels": np.linalg.norm(se3.apply(steps[-1][1], source) - target, axis=1)
        < stage.max_distance,
    }


@pytest.mark.parametrize(
    "description",
    [
        plan(
            (5, 8, 6),
            [[3, 3], [4, 3]],
            [layer(5, 3, 1), layer(6, 2, 3, relu=False), layer(7, 3, 2, norm=False, relu=False)],
        ),
        plan(
            (7, 12, 5),
            [[2, 5], [3, 3]],
            [layer(6, 2, 1), layer(4, 5, 1, norm=False, relu=False)],
        ),
        plan((3, 10, 4), [[4, 3]], [layer(3, 3, 4, norm=False, relu=False)], local_frame="KITTI", batch=2),
    ],
    ids=["three layers", "wide and even kernels", "without frames"],
)
def test_other_plans(tmp_path: Path, description: dict[str, Any]) -> None:
    from run import main

    torch.manual_seed(0)
    record(tmp_path / "made", description)
    assert main([str(tmp_path / "made")]) == 0
    values = dict(np.load(tmp_path / "made.npz"))
    for name in ("out.tgt.descriptors", "train.out.loss", "hcf.out.seeds", "match.out.raw"):
        whole = values[name].dtype.kind in "iu"
        spoiled = (values[name] + 1) % len(values[name]) if whole else values[name] + np.float32(0.05)
        np.savez(tmp_path / "made.npz", **{**values, name: np.ascontiguousarray(spoiled)})
        assert main([str(tmp_path / "made")]) == 1, name
