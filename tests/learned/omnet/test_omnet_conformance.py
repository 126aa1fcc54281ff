# SPDX-License-Identifier: MIT
"""OMNet against the original's recording, and recordings of our own network with other plans, which must pass too.

The latter say nothing about the original: they show that iterations, delay, layers and widths come from the JSON.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from omnet_pairs import shapes

from hybridreg.learned.omnet.losses import step_labels
from hybridreg.learned.omnet.network import OmnetNetwork, OmnetOutput
from hybridreg.learned.omnet.published_errors import pose_errors
from hybridreg.learned.omnet.quaternions import matrix_of
from hybridreg.learned.omnet.targets import compute_targets


def test_every_output_agrees(omnet_stem: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from run import main

    assert main([str(omnet_stem)]) == 0
    assert "224 of 224 within tolerance" in capsys.readouterr().out


def plan(
    encoder: list[int], fusion: list[int], decoder: list[int], regression: list[int], **changes: Any
) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    return {
        "points": 120,
        "iterations": 4,
        "mask_delay": 2,
        "overlap_distance": 0.1,
        "encoder": encoder,
        "encoder_point_feature_layer": 2,
        "fusion": fusion,
        "decoder": [*decoder, 2],
        "regression": [*regression, 7],
        "regression_input": 2 * (fusion[-1] + sum(decoder)),
        "bn_eps": 1e-5,
        "bn_momentum": 0.1,
        "normalize_eps": 1e-12,
        "loss": {"class_weights": [0.7, 0.3], "quaternion_weight": 1.0, "translation_weight": 4.0},
        **changes,
    }


PLANS = {
    "other widths": plan([8, 12, 8, 10, 20], [16, 14, 12], [10, 8, 6], [24, 16, 12, 8]),
    "two iterations, early mask": plan([8, 12, 20], [14, 12], [10, 8], [16, 8], iterations=2, mask_delay=1),
    "six iterations, late mask": plan([8, 6, 20], [12], [8], [16], iterations=6, mask_delay=4),
    "local features of layer 3": plan(
        [8, 12, 9, 20], [14, 12], [10, 8], [16, 8], encoder_point_feature_layer=3
    ),
}


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network."""
    from recorded_omnet import names_of, network_config

    torch.manual_seed(2)
    network = OmnetNetwork(network_config(description))
    batch, truth = shapes(5, seed=1)
    with torch.no_grad():
        network.train()(batch)  # statistics that are not those of a new network
    names = names_of(network)
    weights = {f"w.{names[name]}": value.clone().numpy() for name, value in network.state_dict().items()}
    np.savez(stem.with_name(f"{stem.name}_weights.npz"), **weights)
    targets = compute_targets(truth)
    values: dict[str, Any] = {
        "in.points_src": batch.source,
        "in.points_ref": batch.target,
        "in.transform_gt": truth,
        "in.pose_gt": targets.pose,
    }
    with torch.no_grad():
        values |= _run(network.eval(), batch, targets, "out")[0]
    last = values[f"out.{description['iterations'] - 1}.transform"].double().numpy()
    for euler in ("xyz", "zyx"):
        errors = pose_errors(last, truth.double().numpy(), euler)  # type: ignore[arg-type]
        values |= {f"out.metrics_{euler}.{name}": torch.tensor(value) for name, value in errors.items()}
    trained, total = _run(network.train(), batch, targets, "train")
    total.backward()
    parameters = {names[name]: p for name, p in network.named_parameters() if p.grad is not None}
    values |= trained | {
        "train.grad.fusion.1.conv_block1.0.weight": network.fusion[1].layers[0].linear.weight.grad
    }
    state = {names[name]: value for name, value in network.state_dict().items()}
    values |= {f"train.after.{name}": value for name, value in state.items() if "running" in name}
    arrays = {name: value.detach().numpy() for name, value in values.items()}
    arrays["train.grad_names"] = np.array(list(parameters))
    arrays["train.grad_norms"] = np.array([float(p.grad.double().norm()) for p in parameters.values()])
    np.savez(stem.with_name(f"{stem.name}.npz"), **arrays)
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(description))


def _run(network: OmnetNetwork, batch: Any, targets: Any, mode: str) -> tuple[dict[str, Any], torch.Tensor]:
    output = network(batch)
    values: dict[str, Any] = {}
    for i, step in enumerate(output.steps):
        alone = OmnetOutput(steps=(step,), source=batch.source, target=batch.target)
        labels = step_labels(alone, step, targets, network.config.loss)
        parts = {
            "src_input_mask": step.source_mask.byte(),
            "ref_input_mask": step.target_mask.byte(),
            "src_labels": labels[0].byte(),
            "ref_labels": labels[1].byte(),
            "src_logits": step.source_logits,
            "ref_logits": step.target_logits,
            "src_points_first64": step.source_points[:, :64],
            "regression_input": step.pooled,
            "pose_step": step.pose_step,
            "pose": step.pose,
            "transform": matrix_of(step.pose),
        }
        values |= {f"{mode}.{i}.{name}": value for name, value in parts.items()}
    losses = network.losses(output, targets)
    total = torch.stack(list(losses.values())).sum()
    values[f"{mode}.loss.total"] = total
    return values | {
        f"{mode}.loss.quat_{i}": losses[f"quaternion_{i}"] for i in range(len(output.steps))
    }, total


@pytest.mark.parametrize("name", PLANS)
def test_other_plans(tmp_path: Path, name: str) -> None:
    from run import main

    record(tmp_path / "made", PLANS[name])
    assert main([str(tmp_path / "made")]) == 0


@pytest.mark.parametrize(
    "key", ["out.1.pose_step", "train.loss.total", "train.grad_norms", "out.metrics_zyx.R_MAE"]
)
def test_a_changed_value_is_noticed(tmp_path: Path, key: str, capsys: pytest.CaptureFixture[str]) -> None:
    from run import main

    record(tmp_path / "made", PLANS["other widths"])
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    values[key] = values[key] * 1.01
    values["out.0.unheard"] = np.zeros(3)
    np.savez(tmp_path / "made.npz", **values)
    assert main([str(tmp_path / "made")]) == 1
    printed = capsys.readouterr().out.splitlines()[-1]
    assert f"'{key}'" in printed
    assert "'out.0.unheard'" in printed


def test_a_plan_that_does_not_add_up_is_refused(tmp_path: Path) -> None:
    from recorded_omnet import network_config

    wrong = {**PLANS["other widths"], "regression_input": 7}
    with pytest.raises(ValueError, match="pooled widths"):
        network_config(wrong)
