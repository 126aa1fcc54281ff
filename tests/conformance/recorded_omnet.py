# SPDX-License-Identifier: MIT
"""OMNet against its recording: quaternions, every iteration, losses of both published forms, metrics, training.

Each iteration is given the recorded masks and the recorded steps before it: rounding grows from one to the next, so
that in the last even the exact result differs from the recorded one by more than the tolerance. What the iterations
make of each other's outputs is compared besides ("own chain").
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from arrays import Found, apart, complete, gradients, held, read_plan, read_values, read_weights, statistics
from torch import Tensor

from hybridreg.learned.omnet.batch import OmnetBatch
from hybridreg.learned.omnet.config import OmnetConfig, OmnetLossConfig
from hybridreg.learned.omnet.losses import omnet_losses, step_labels
from hybridreg.learned.omnet.network import OmnetNetwork, OmnetOutput, Step
from hybridreg.learned.omnet.official_names import official_name
from hybridreg.learned.omnet.published_errors import pose_errors
from hybridreg.learned.omnet.quaternions import compose, matrix_of, multiply, pose_of, rotate
from hybridreg.learned.omnet.targets import OmnetTargets, compute_targets
from hybridreg.learned.weights import load_official_tensors

FORWARD, TRAINED_LOGITS, TIE = 1e-4, 1e-3, 1e-4
_LOSSES = {"mask": "cls", "quaternion": "quat", "translation": "translate"}
# Along which axis a recording has the first points alone.
_POINTS = {"points": 1, "point_features": 2, "last_features": 2, "fused": 2}


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    config, (want, recorded) = network_config(read_plan(stem)), read_values(stem)
    network = OmnetNetwork(config)
    names = names_of(network)
    load_official_tensors(network, read_weights(stem), stem.name, lambda name: names[name])
    network.eval()
    batch = OmnetBatch(source=want["in.points_src"], target=want["in.points_ref"])
    targets = compute_targets(want["in.transform_gt"])
    found: Found = {"in.pose_gt": (apart(targets.pose, want["in.pose_gt"]), FORWARD)} | _quaternions(want)
    with torch.no_grad():
        found |= _iterations(network, batch, targets, want, "out")
        found |= {
            f"out.{i}.pose (own chain)": (apart(step.pose, want[f"out.{i}.pose"]), FORWARD)
            for i, step in enumerate(network(batch).steps)
        }
    found |= _metrics(want, config.iterations)
    trained = copy.deepcopy(network).train()
    found |= _iterations(trained, batch, targets, want, "train")
    ours = {official: name for name, official in names.items()}
    found |= gradients(trained, ours, want, recorded) | statistics(trained, ours, want)
    inputs = {"in.points_src", "in.points_ref", "in.transform_gt", "ops.pose_a", "ops.pose_b", "ops.points"}
    return complete(found, want, inputs)


def network_config(plan: Mapping[str, Any]) -> OmnetConfig:
    """Our configuration of a recorded plan."""
    loss = plan["loss"]
    config = OmnetConfig(
        encoder=tuple(plan["encoder"]),
        local_layer=plan["encoder_point_feature_layer"],
        fusion=tuple(plan["fusion"]),
        decoder=tuple(plan["decoder"][:-1]),
        regression=tuple(plan["regression"][:-1]),
        iterations=plan["iterations"],
        mask_delay=plan["mask_delay"],
        points=plan["points"],
        normalize_eps=plan["normalize_eps"],
        bn_eps=plan["bn_eps"],
        bn_momentum=plan["bn_momentum"],
        loss=OmnetLossConfig(
            overlap_distance=plan["overlap_distance"],
            class_weights=tuple(loss["class_weights"]),
            quaternion_weight=loss["quaternion_weight"],
            translation_weight=loss["translation_weight"],
        ),
    )
    ends = (plan["decoder"][-1], plan["regression"][-1], plan["regression_input"])
    if ends != (2, 7, config.regression_input):
        raise ValueError(f"classes, pose and pooled widths {ends} are not (2, 7, {config.regression_input})")
    return config


def names_of(network: OmnetNetwork) -> dict[str, str]:
    """The original's name of each of our tensors."""
    return {name: official_name(name, len(network.config.decoder)) for name in network.state_dict()}


def _quaternions(want: Mapping[str, Tensor]) -> Found:
    if "ops.pose_a" not in want:
        return {}
    a, b = want["ops.pose_a"], want["ops.pose_b"]
    made = {
        "multiply_a_b": multiply(a[:, :4], b[:, :4]),
        "rotate_a": rotate(a[:, :4], want["ops.points"]) + a[:, None, 4:],
        "matrix_a": matrix_of(a),
        "compose_a_then_b": compose(a, b),
        "quaternion_of_matrix_a": pose_of(matrix_of(a.double())),
    }
    return held(made, want, "ops.")


def _iterations(
    network: OmnetNetwork, batch: OmnetBatch, targets: OmnetTargets, want: Mapping[str, Tensor], mode: str
) -> Found:
    """All iterations after the recorded ones; in training mode the total loss's gradient is left on the network."""
    found: Found = {}
    steps: list[Step] = []
    before = None
    for i in range(network.config.iterations):
        masks = [want[f"{mode}.{i}.{side}_input_mask"].bool() for side in ("src", "ref")]
        found |= _masks(masks, steps, i, network.config.mask_delay, mode)
        parts, step = _watched(network, i, batch, masks, before)
        steps.append(step)
        recorded = (want[f"{mode}.{i}.pose_step"], want[f"{mode}.{i}.pose"])
        before = replace(step, pose_step=recorded[0], pose=recorded[1])
        labels = step_labels(
            OmnetOutput(steps=(step,), source=batch.source, target=batch.target),
            step,
            targets,
            network.config.loss,
        )
        parts |= {
            "src_points": step.source_points,
            "regression_input": step.pooled,
            "pose_step": step.pose_step,
            "pose": step.pose,
            "transform": matrix_of(step.pose),
            "src_labels": labels[0],
            "ref_labels": labels[1],
        }
        found |= held(parts, want, f"{mode}.{i}.", FORWARD, _POINTS)
        logits = {"src_logits": step.source_logits, "ref_logits": step.target_logits}
        found |= held(logits, want, f"{mode}.{i}.", FORWARD if mode == "out" else TRAINED_LOGITS)
        found |= held({"pose": step.pose}, want, f"mge.{mode}.{i}.")
    output = OmnetOutput(steps=tuple(steps), source=batch.source, target=batch.target)
    return found | _losses(network, output, targets, want, mode)


def _masks(masks: list[Tensor], steps: list[Step], i: int, delay: int, mode: str) -> Found:
    """Recorded masks against those that our logits make; scores that tie are forgiven and counted."""
    found: Found = {}
    for k, side in enumerate(("src", "ref")):
        key = f"{mode}.{i}.{side}_input_mask"
        if i < delay:
            found[key] = (float((~masks[k]).sum()), 0.0)
            continue
        logits = (steps[-1].source_logits, steps[-1].target_logits)[k].detach()
        odd = (logits.argmax(1) == 1) != masks[k]
        gap = (logits[:, 1] - logits[:, 0]).abs()[odd]
        found[key] = (float(gap.max()) if len(gap) else 0.0, TIE)
        found[f"{key} (ties forgiven)"] = (float(odd.sum()), math.inf)
    return found


def _watched(
    network: OmnetNetwork, i: int, batch: OmnetBatch, masks: list[Tensor], before: Step | None
) -> tuple[dict[str, Tensor], Step]:
    """An iteration, and what its encoder and fusion gave for source and target in turn."""
    seen: dict[str, list[Any]] = {"encoder": [], "fusion": []}
    hooks = [
        getattr(network, part)[i].register_forward_hook(lambda _, __, out, part=part: seen[part].append(out))
        for part in seen
    ]
    step = network.step(i, batch, masks, before)
    for hook in hooks:
        hook.remove()
    parts = {}
    for k, side in enumerate(("src", "ref")):
        local, last, pooled = seen["encoder"][k]
        parts |= {f"{side}_point_features": local, f"{side}_last_features": last, f"{side}_global": pooled}
        parts[f"{side}_fused"] = seen["fusion"][k]
    return parts, step


def _losses(
    network: OmnetNetwork, output: OmnetOutput, targets: OmnetTargets, want: Mapping[str, Tensor], mode: str
) -> Found:
    found: Found = {}
    megengine = replace(network.config.loss, mask_form="megengine")
    for prefix, config in (("", network.config.loss), ("mge.", megengine)):
        losses = omnet_losses(output, targets, config)
        total = sum(losses.values(), torch.zeros(()))
        ours = {"total": total}
        for name, value in losses.items():
            kind, _, i = name.rpartition("_")
            ours[f"{_LOSSES[kind]}_{i}"] = value
        found |= held(ours, want, f"{prefix}{mode}.loss.")
        if not prefix and total.requires_grad:
            total.backward()
    return found


def _metrics(want: Mapping[str, Tensor], iterations: int) -> Found:
    """Of the recorded poses; degrees squared run into thousands, where float32 has no fourth decimal."""
    poses = [want[key].double().numpy() for key in (f"out.{iterations - 1}.transform", "in.transform_gt")]
    found: Found = {}
    for euler in ("xyz", "zyx"):
        for name, value in pose_errors(poses[0], poses[1], euler).items():  # type: ignore[arg-type]
            key = f"out.metrics_{euler}.{name}"
            if key in want:
                found[key] = (abs(value - float(want[key])), max(FORWARD, 1e-6 * abs(float(want[key]))))
    return found
