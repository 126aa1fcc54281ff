# SPDX-License-Identifier: MIT
"""FCGF against its recording: quantisation, sparse convolutions alone, every layer, nearest neighbours, training."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from arrays import (
    Found,
    apart,
    complete,
    gradients,
    held,
    read_plan,
    read_values,
    read_weights,
    statistics,
    unequal,
)
from torch import Tensor

from hybridreg.learned.fcgf.batch import FcgfBatch, VoxelClouds, make_batch
from hybridreg.learned.fcgf.config import FcgfConfig, FcgfLossConfig
from hybridreg.learned.fcgf.losses import Mined, hardest_contrastive
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.fcgf.official_names import official_name
from hybridreg.learned.fcgf.targets import FcgfTargets, positive_pairs
from hybridreg.learned.layers.kernel_maps import kernel_offsets
from hybridreg.learned.layers.sparse_conv import convolve
from hybridreg.learned.layers.voxels import VoxelPyramid, quantise
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.weights import load_official_tensors

FORWARD, TIE = 1e-4, 1e-5


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    config, (want, recorded) = network_config(read_plan(stem)), read_values(stem)
    network = FcgfNetwork(config)
    load_official_tensors(network, read_weights(stem), stem.name, official_name)
    batch = make_batch(want["in.ref_points"].numpy(), want["in.src_points"].numpy(), config)
    found = _grid(want, config) | _alone(want)
    for side, clouds in (("src", batch.source), ("ref", batch.target)):
        seen = layer_outputs(network.eval(), clouds, config)
        found |= held(seen, want, f"out.{side}.")
    found |= _nearest(network, batch, want)
    found |= _training(network, batch, want, recorded)
    inputs = {"in.ref_points", "in.src_points", "in.transform", "unit.coords", "unit.features"}
    inputs |= {key for key in want if key.startswith("unit.weight_")}
    inputs |= {"train.sel_src", "train.sel_ref", "train.positive_rows"}
    return complete(found, want, inputs)


def network_config(plan: Mapping[str, Any]) -> FcgfConfig:
    """Our configuration of a recorded plan."""
    loss = plan["loss"]
    return FcgfConfig(
        in_channels=plan["in_channels"],
        out_channels=plan["out_channels"],
        channels=tuple(plan["channels"]),
        tr_channels=tuple(plan["tr_channels"]),
        first_kernel=plan["conv1_kernel_size"],
        kernel=plan["kernel_size"],
        tr_kernel=plan["tr_kernel_size"],
        final_kernel=plan["final_kernel_size"],
        stride=plan["stride"],
        normalize=plan["normalize_feature"],
        normalize_eps=plan["normalize_eps"],
        bn_eps=plan["bn_eps"],
        bn_momentum=plan["bn_momentum"],
        voxel=plan["voxel"],
        loss=FcgfLossConfig(
            positive_margin=loss["positive_margin"],
            negative_margin=loss["negative_margin"],
            negative_weight=loss["negative_weight"],
            positives=loss["positives"],
            candidates=loss["hard_negatives"],
            search_voxels=loss["matching_search_voxel_multiplier"],
            distance_eps=loss["distance_eps"],
        ),
    )


def _grid(want: Mapping[str, Tensor], config: FcgfConfig) -> Found:
    found = {}
    for side in ("src", "ref"):
        rows, coords = quantise(want[f"in.{side}_points"], config.voxel)
        found[f"in.{side}_voxel_rows"] = (unequal(rows, want[f"in.{side}_voxel_rows"]), 0.0)
        found[f"in.{side}_coords"] = (unequal(coords, want[f"in.{side}_coords"]), 0.0)
    return found


def by_coordinate(pyramid: VoxelPyramid, level: int) -> Tensor:
    """Rows of a level in the recording's order: the input's on the first, by x, then y, then z on others."""
    if level == 0:
        return pyramid.inverse
    x, y, z = pyramid.levels[level][:, 1:].numpy().T
    return torch.from_numpy(np.lexsort((z, y, x)))


@torch.no_grad()
def layer_outputs(network: FcgfNetwork, clouds: VoxelClouds, config: FcgfConfig) -> dict[str, Tensor]:
    """Everything that a recording may have of one cloud, by the recording's names."""
    seen: dict[str, Tensor] = {}
    pyramid, strides = clouds.pyramid, config.strides
    watched = {"conv1_tr": (network.mix, 0), "final": (network.final, 0)}
    for level, layer in enumerate(network.encoder):
        watched |= {f"conv{level + 1}": (layer.conv, level), f"norm{level + 1}": (layer.norm, level)}
        watched[f"encoder.s{strides[level]}"] = (layer.block, level)
    for level, layer in enumerate(network.decoder):
        watched |= {f"conv{level + 2}_tr": (layer.conv, level), f"norm{level + 2}_tr": (layer.norm, level)}
        watched[f"decoder.s{strides[level]}"] = (layer.block, level)
    hooks = [
        module.register_forward_hook(
            lambda _, __, out, name=name, level=level: seen.__setitem__(
                name, out[by_coordinate(pyramid, level)]
            )
        )
        for name, (module, level) in watched.items()
    ]
    seen["features"] = network.encode(clouds)
    for hook in hooks:
        hook.remove()
    for level in range(1, len(strides)):
        seen[f"coords.s{strides[level]}"] = pyramid.levels[level][by_coordinate(pyramid, level), 1:]
    return seen


def _alone(want: Mapping[str, Tensor]) -> Found:
    """Single convolutions; recordings have kernels of 2, 3 and 5 whatever the network's are."""
    if "unit.coords" not in want:
        return {}
    coords = want["unit.coords"].long()
    pyramid = VoxelPyramid(torch.cat([coords.new_zeros(len(coords), 1), coords], 1), (1, 2, 4))
    features = want["unit.features"][pyramid.order]
    k3, tr3 = want["unit.weight_3"], want["unit.weight_tr_3"]
    down = convolve(features, k3, pyramid.map(3, 0, 1))
    twice = convolve(down, tr3, pyramid.map(3, 1, 2))
    made = {
        "k3s1": (convolve(features, k3, pyramid.map(3, 0, 0)), 0),
        "k5s1": (convolve(features, want["unit.weight_5"], pyramid.map(5, 0, 0)), 0),
        "k3s2": (down, 1),
        "k2s2": (convolve(features, want["unit.weight_2"], pyramid.map(2, 0, 1)), 1),
        "k3s2_then_tr3s2": (convolve(down, tr3, pyramid.map(3, 0, 1), transposed=True), 0),
        "k3s2_k3s2_k3s1": (convolve(twice, k3, pyramid.map(3, 2, 2)), 2),
        "coords.s2": (pyramid.levels[1][:, 1:], 1),
        "coords.s4": (pyramid.levels[2][:, 1:], 2),
    }
    ours = {name: value[by_coordinate(pyramid, level)] for name, (value, level) in made.items()}
    return held(ours | {f"offsets_{size}": kernel_offsets(size) for size in range(2, 8)}, want, "unit.")


@torch.no_grad()
def _nearest(network: FcgfNetwork, batch: FcgfBatch, want: Mapping[str, Tensor]) -> Found:
    output = network.eval()(batch)
    squares = (output.source[:, None] - output.target[None]).square().sum(2)
    least, row = squares.min(1)
    theirs = squares.gather(1, want["out.src_nearest_ref"].long()[:, None])[:, 0]
    swapped = row != want["out.src_nearest_ref"]
    gap = float((theirs - least)[swapped].max()) if bool(swapped.any()) else 0.0
    return {
        "out.src_nearest_ref": (gap if gap <= TIE else math.inf, TIE),
        "out.src_nearest_ref (ties forgiven)": (float(swapped.sum()), math.inf),
        "out.src_nearest_ref_squared_distance": (
            apart(least, want["out.src_nearest_ref_squared_distance"]),
            FORWARD,
        ),
    }


def _training(
    network: FcgfNetwork, batch: FcgfBatch, want: Mapping[str, Tensor], recorded: list[str]
) -> Found:
    network = copy.deepcopy(network).train()
    output, config = network(batch), network.config
    targets = FcgfTargets(
        positives=want["train.positives"].long(),
        anchors=want["train.positive_rows"].long(),
        source_candidates=want["train.sel_src"].long(),
        target_candidates=want["train.sel_ref"].long(),
    )
    mined = hardest_contrastive(output.source, output.target, targets, config.loss)
    losses = network.losses(output, targets)
    total = sum(losses.values(), torch.zeros(()))
    total.backward()
    names = {official_name(name): name for name in network.state_dict()}
    return (
        _positives(batch, want, config)
        | _mined("ref", mined.in_target, want)
        | _mined("src", mined.in_source, want)
        | {
            "train.positive_loss": (apart(mined.positive, want["train.positive_loss"]), FORWARD),
            "train.negative_loss": (apart(mined.negative, want["train.negative_loss"]), FORWARD),
            "train.loss": (apart(total, want["train.loss"]), FORWARD),
        }
        | held({"src_features": output.source, "ref_features": output.target}, want, "train.")
        | gradients(network, names, want, recorded)
        | statistics(network, names, want)
    )


def _mined(side: str, mined: Mined, want: Mapping[str, Tensor]) -> Found:
    """Candidates whose distances tie may be exchanged: the distance of ours must be the recorded one all the same."""
    key = f"train.hardest_{side}"
    swapped = mined.row != want[key]
    gap = (mined.distance.detach() - want[f"{key}_distance"]).abs()[swapped]
    far = bool((gap > TIE).any())
    same = ~swapped
    return {
        key: (math.inf if far else 0.0, 0.0),
        f"{key} (ties forgiven)": (float(swapped.sum()), math.inf),
        f"{key}_distance": (apart(mined.distance, want[f"{key}_distance"]), FORWARD),
        f"{key}_is_negative": (unequal(mined.negative[same], want[f"{key}_is_negative"][same]), 0.0),
    }


def _positives(batch: FcgfBatch, want: Mapping[str, Tensor], config: FcgfConfig) -> Found:
    radius = config.voxel * config.loss.search_voxels
    moved = apply_transform(batch.source.points, want["in.transform"])
    ours, theirs = positive_pairs(moved, batch.target.points, radius), want["train.positives"].long()
    odd = np.array(
        list({tuple(p) for p in ours.tolist()} ^ {tuple(p) for p in theirs.tolist()}), dtype=np.int64
    )
    odd = odd.reshape(-1, 2)
    distance = (moved[odd[:, 0]].double() - batch.target.points[odd[:, 1]].double()).norm(dim=1)
    worst = float((distance - radius).abs().max()) if len(odd) else 0.0
    return {
        "train.positives": (worst, TIE),
        "train.positives (ties forgiven)": (float(len(odd)), math.inf),
    }
