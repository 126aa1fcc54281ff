# SPDX-License-Identifier: MIT
"""FCGF against the original's recording, and recordings of our own network with other plans, which must pass too.

The latter say nothing about the original (test_fcgf_sparse_conv.py holds kernels of all sizes against torch): they show
that levels, widths, kernels, strides and voxels come from the JSON.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.fcgf.batch import make_batch
from hybridreg.learned.fcgf.losses import hardest_contrastive
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.fcgf.official_names import official_name
from hybridreg.learned.fcgf.targets import compute_targets
from hybridreg.learned.layers.voxels import quantise


def test_every_output_agrees(fcgf_stem: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from run import main

    assert main([str(fcgf_stem)]) == 0
    assert "121 of 121 within tolerance" in capsys.readouterr().out


def plan(channels: list[int], tr_channels: list[int], **changes: Any) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    loss = {
        "positive_margin": 0.1,
        "negative_margin": 1.4,
        "negative_weight": 1.0,
        "positives": 200,
        "hard_negatives": 60,
        "matching_search_voxel_multiplier": 1.5,
        "distance_eps": 1e-7,
    }
    return {
        "in_channels": 1,
        "out_channels": 10,
        "channels": channels,
        "tr_channels": tr_channels,
        "conv1_kernel_size": 5,
        "kernel_size": 3,
        "stride": 2,
        "tr_kernel_size": 3,
        "final_kernel_size": 1,
        "bn_eps": 1e-5,
        "bn_momentum": 0.05,
        "normalize_feature": True,
        "normalize_eps": 0.0,
        "voxel": 0.6,
        "loss": loss,
        **changes,
    }


PLANS = {
    "three levels, first kernel 7": plan([6, 8, 10], [7, 9, 5], conv1_kernel_size=7),
    "two levels, not normalised": plan(
        [6, 8], [5, 7], normalize_feature=False, conv1_kernel_size=3, voxel=0.9
    ),
    "five levels, even kernels": plan(
        [4, 5, 6, 7, 8], [8, 7, 6, 5, 4], kernel_size=2, tr_kernel_size=2, voxel=0.4
    ),
    "stride 3, wide last kernel": plan(
        [6, 8, 10], [7, 9, 5], stride=3, tr_kernel_size=5, final_kernel_size=3
    ),
}


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network."""
    from recorded_fcgf import layer_outputs, network_config

    config = network_config(description)
    torch.manual_seed(1)
    network = FcgfNetwork(config)
    truth = yaw(25.0, (1.0, 0.0, 0.0))
    target, source = street(1, 1500, 10.0), moved(street(1, 1500, 10.0)[300:], np.linalg.inv(truth))
    batch = make_batch(target, source, config)
    with torch.no_grad():
        network(batch)  # statistics that are not those of a new network
    network.eval()
    weights = {
        f"w.{official_name(name)}": value.clone().numpy() for name, value in network.state_dict().items()
    }
    np.savez(stem.with_name(f"{stem.name}_weights.npz"), **weights)
    values: dict[str, Any] = {
        "in.ref_points": target,
        "in.src_points": source,
        "in.transform": truth.astype(np.float32),
    }
    for side, clouds in (("src", batch.source), ("ref", batch.target)):
        rows, coords = quantise(torch.from_numpy(values[f"in.{side}_points"]), config.voxel)
        values |= {f"in.{side}_voxel_rows": rows.numpy(), f"in.{side}_coords": coords.numpy()}
        seen = layer_outputs(network, clouds, config)
        values |= {f"out.{side}.{name}": value.numpy() for name, value in seen.items()}
    output = network(batch)
    squares = (output.source[:, None] - output.target[None]).square().sum(2).min(1)
    values["out.src_nearest_ref"] = squares.indices.numpy()
    values["out.src_nearest_ref_squared_distance"] = squares.values.detach().numpy()
    values |= _training(network.train(), batch, torch.from_numpy(truth).float())
    np.savez(stem.with_name(f"{stem.name}.npz"), **values)
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(description))


def _training(network: FcgfNetwork, batch: Any, truth: torch.Tensor) -> dict[str, Any]:
    targets = compute_targets(batch, truth, network.config, torch.Generator().manual_seed(0))
    output = network(batch)
    found = hardest_contrastive(output.source, output.target, targets, network.config.loss)
    total = found.positive + network.config.loss.negative_weight * found.negative
    total.backward()
    named = {official_name(name): p for name, p in network.named_parameters()}
    values: dict[str, Any] = {
        "train.positives": targets.positives,
        "train.positive_rows": targets.anchors,
        "train.sel_src": targets.source_candidates,
        "train.sel_ref": targets.target_candidates,
        "train.positive_loss": found.positive,
        "train.negative_loss": found.negative,
        "train.loss": total,
        "train.src_features_first256": output.source[:256],
        "train.ref_features_first256": output.target[:256],
        "train.grad.final.bias": named["final.bias"].grad,
        "train.grad.conv2.kernel": named["conv2.kernel"].grad,
    }
    for side, mined in (("ref", found.in_target), ("src", found.in_source)):
        values[f"train.hardest_{side}"] = mined.row
        values[f"train.hardest_{side}_distance"] = mined.distance
        values[f"train.hardest_{side}_is_negative"] = mined.negative
    state = {official_name(name): value for name, value in network.state_dict().items()}
    values |= {f"train.after.{name}": value for name, value in state.items() if "running" in name}
    arrays = {name: value.detach().numpy() for name, value in values.items()}
    arrays["train.grad_names"] = np.array(list(named))
    arrays["train.grad_norms"] = np.array([float(p.grad.double().norm()) for p in named.values()])
    return arrays


@pytest.mark.parametrize("name", PLANS)
def test_other_plans(tmp_path: Path, name: str) -> None:
    from run import main

    record(tmp_path / "made", PLANS[name])
    assert main([str(tmp_path / "made")]) == 0


@pytest.mark.parametrize(
    "key", ["out.src.encoder.s4", "train.loss", "train.grad_norms", "train.after.norm1.bn.running_var"]
)
def test_a_changed_value_is_noticed(tmp_path: Path, key: str, capsys: pytest.CaptureFixture[str]) -> None:
    from run import main

    record(tmp_path / "made", PLANS["three levels, first kernel 7"])
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    values[key] = values[key] * 1.01
    values["out.src.unheard"] = np.zeros(3)
    np.savez(tmp_path / "made.npz", **values)
    assert main([str(tmp_path / "made")]) == 1
    assert f"not: ['{key}', 'out.src.unheard']" in capsys.readouterr().out


def test_ties_are_forgiven_and_counted(tmp_path: Path) -> None:
    from recorded_fcgf import compare

    record(tmp_path / "made", PLANS["two levels, not normalised"])
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    values["train.positives"] = values["train.positives"][:-1]
    np.savez(tmp_path / "made.npz", **values)
    found = compare(tmp_path / "made")
    assert found["train.positives (ties forgiven)"][0] == 1
    assert found["train.positives"][0] > found["train.positives"][1], "the pair is far from the radius"
