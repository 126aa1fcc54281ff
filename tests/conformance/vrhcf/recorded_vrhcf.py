# SPDX-License-Identifier: MIT
"""VRHCF: SphereNet and HCF against every recorded output, each step fed with recorded inputs, to 1e-4."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from arrays import complete, read_arrays, read_plan, read_weights
from ties import Compared
from torch import Tensor
from torch.nn import functional as F
from vrhcf_estimator import compare_estimator

from hybridreg.learned.vrhcf.batch import SphereBatch
from hybridreg.learned.vrhcf.config import ShellConv, SphereNetConfig, SurfaceConv
from hybridreg.learned.vrhcf.keypoint_matching import match_descriptors
from hybridreg.learned.vrhcf.losses import SphereLosses, distances, hardest_in_batch
from hybridreg.learned.vrhcf.network import SphereNet
from hybridreg.learned.vrhcf.official_names import UNUSED, official_names
from hybridreg.learned.vrhcf.spherical_voxels import counts, spherical, voxels
from hybridreg.learned.vrhcf.upright_frames import reference_axes, upright_rotations
from hybridreg.learned.weights import load_official_tensors

TOLERANCE = 1e-4
_CHAIN = 48  # a multiple of any published batch of frames
_CLOSE = 1e-6  # distances of descriptors: nearer ones are equals


def compare(stem: Path) -> dict[str, tuple[float, float]]:
    """Largest difference and tolerance by output."""
    plan, values, tensors = (
        read_plan(stem),
        read_arrays(stem.with_name(f"{stem.name}.npz")),
        read_weights(stem),
    )
    network = _loaded(network_config(plan), tensors, stem.name)
    found = Compared()
    with torch.no_grad():
        for side in ("src", "tgt"):
            _descriptors(network, values, side, found)
        _steps(network, values, found)
        _without_frames(plan, tensors, values, found)
        _losses(plan, values, found)
        _matching(values, found)
    _training(network, plan, values, found)
    for part in (name for name in plan if name.startswith("hcf")):
        compare_estimator(part, plan, values, found)
    found.print_ties()
    return complete(found.values, values, [name for name in values if ".in." in f".{name}"])


def network_config(plan: dict[str, Any], **changes: Any) -> SphereNetConfig:
    """Our configuration of a recorded plan; what the recording's original does is what was released."""
    descriptor, loss = plan["descriptor"], plan["loss"]
    fields = {
        "radius": descriptor["radius"],
        "patch_points": descriptor["points_per_patch"],
        "radial": descriptor["radial"],
        "azimuth": descriptor["azimuth"],
        "elevation": descriptor["elevation"],
        "interpolated": descriptor["interpolation"],
        "local_frame": "none" if descriptor["local_frame"] == "KITTI" else "axis",
        "frame_batch": descriptor["batch"],
        "shells": tuple(ShellConv(width=width, kernel=kernel) for width, kernel in descriptor["conv3d"]),
        "surface": tuple(SurfaceConv(**layer) for layer in descriptor["conv2d"]),
        "positive_margin": loss["positive_margin"],
        "negative_margin": loss["negative_margin"],
    }
    return SphereNetConfig(**{**fields, **changes})


def _loaded(config: SphereNetConfig, tensors: dict[str, Tensor], origin: str) -> SphereNet:
    network = SphereNet(config)
    load_official_tensors(network, tensors, origin, official_names(network).__getitem__, UNUSED)
    return network.eval()


def _descriptors(network: SphereNet, values: dict[str, Tensor], side: str, found: Compared) -> None:
    patches = values[f"in.{side}_patches"]
    centred = patches - patches[:, -1:]
    local = centred
    if f"out.{side}.rotation" in values:
        axes = reference_axes(centred, patches[:, -1])
        found.close(f"out.{side}.z_axis", axes, values[f"out.{side}.z_axis"], TOLERANCE)
        # On the recorded axes: the arc cosine near 1 makes a milliradian of an axis's last digit.
        axes = values[f"out.{side}.z_axis"]
        turned = upright_rotations(axes, network.config.frames, network.config.frame_batch)
        found.close(f"out.{side}.rotation", turned, values[f"out.{side}.rotation"], TOLERANCE)
        local = centred @ values[f"out.{side}.rotation"]
    given = network.surface(network.voxelise(local)).amax((2, 3))
    found.close(f"out.{side}.descriptors", given, values[f"out.{side}.descriptors"], TOLERANCE)
    # From the patches alone a point may be moved by rounding of the axis; descriptors are some 2 apart. The last ones,
    # whose frames are made in a batch that need not be full, stand for all.
    last = patches[-_CHAIN - len(patches) % _CHAIN :]
    expected = values[f"out.{side}.descriptors"][-len(last) :]
    found.close(f"out.{side}.descriptors (chain)", network.describe(last), expected, 2e-2)


def _steps(network: SphereNet, values: dict[str, Tensor], found: Compared) -> None:
    config = network.config
    grid = (config.radial, config.azimuth, config.elevation)
    for name in [name for name in values if name.startswith("out.src.local_points_first")]:
        count = len(values[name])
        patches = values["in.src_patches"][:count]
        local = patches - patches[:, -1:]
        local = local @ values["out.src.rotation"][:count] if "out.src.rotation" in values else local
        found.close(name, local, values[name], TOLERANCE)
        recorded = name.replace("local_points", "spherical")
        found.close(recorded, spherical(values[name]), values[recorded], TOLERANCE)
    for name in [name for name in values if name.startswith("out.src.voxels_")]:
        points = next(values[n] for n in values if n.startswith("out.src.spherical_first"))[
            : len(values[name])
        ]
        if "hard" in name:
            found.close(name, counts(points, config.radius, grid), values[name].float(), 0.0)
        else:
            found.close(name, voxels(points, config.radius, grid)[:, None], values[name], TOLERANCE)
    x = next(values[n] for n in values if n.startswith("out.src.voxels_first"))[:1]
    for index, layer in enumerate(network.layers):
        x = network.flattened(index, x)
        name = f"out.src.conv{index}_first1"
        if name in values:
            own, want = layer.convolved(x), values[name]
            found.close(name, own[:, :, : want.shape[2]] if want.dim() == 5 else own, want, TOLERANCE)
        x = layer(x)


def _without_frames(
    plan: dict[str, Any], tensors: dict[str, Tensor], values: dict[str, Tensor], found: Compared
) -> None:
    network = _loaded(network_config(plan, local_frame="none"), tensors, "the same weights")
    for name in [name for name in values if name.startswith("out.src.descriptors_kitti_first")]:
        patches = values["in.src_patches"][: len(values[name])]
        found.close(name, network.describe(patches), values[name], TOLERANCE)


def _losses(plan: dict[str, Any], values: dict[str, Tensor], found: Compared) -> None:
    units = [F.normalize(values[f"out.{side}.descriptors"], dim=1) for side in ("src", "tgt")]
    for name in [name for name in values if name.startswith("out.loss_first")]:
        count = int(name.removeprefix("out.loss_first"))
        first, second = (unit[:count] for unit in units)
        made = _loss(plan, first, second)
        found.close(name, made.total, values[name], TOLERANCE)
        found.close(
            f"out.accuracy_first{count}",
            100.0 * made.accuracy,
            values[f"out.accuracy_first{count}"],
            TOLERANCE,
        )
        distance = f"out.loss_distances_first{count}"
        found.close(distance, distances(first, second), values[distance], TOLERANCE)


def _loss(plan: dict[str, Any], first: Tensor, second: Tensor) -> SphereLosses:
    return hardest_in_batch(first, second, plan["loss"]["positive_margin"], plan["loss"]["negative_margin"])


def _matching(values: dict[str, Tensor], found: Compared) -> None:
    raw = [values[f"out.{side}.descriptors"] for side in ("src", "tgt")]
    for name, pair in (("raw", raw), ("unit", [F.normalize(d, dim=1) for d in raw])):
        if f"match.out.{name}" not in values:
            continue
        own, want = match_descriptors(pair[0], pair[1], "channels"), values[f"match.out.{name}"]
        source, target = (d / (d.norm(dim=0, keepdim=True) + 1e-6) for d in pair)
        gaps = ((source * target[own]).sum(1) - (source * target[want]).sum(1)).abs()
        found.tied(f"match.out.{name}", own != want, gaps, _CLOSE)


def _training(network: SphereNet, plan: dict[str, Any], values: dict[str, Tensor], found: Compared) -> None:
    count = len(values["train.out.src_descriptors"])
    network.train()
    network.zero_grad()
    batch = SphereBatch(target=values["in.tgt_patches"][:count], source=values["in.src_patches"][:count])
    output = network(batch)
    units = F.normalize(output.source, dim=1), F.normalize(output.target, dim=1)
    made = _loss(plan, *units)
    made.total.backward()
    found.close("train.out.src_descriptors", units[0], values["train.out.src_descriptors"], TOLERANCE)
    found.close("train.out.tgt_descriptors", units[1], values["train.out.tgt_descriptors"], TOLERANCE)
    found.close("train.out.loss", made.total, values["train.out.loss"], TOLERANCE)
    found.close("train.out.accuracy", 100.0 * made.accuracy, values["train.out.accuracy"], TOLERANCE)
    names = official_names(network)
    state = {names[name]: tensor for name, tensor in network.state_dict().items()}
    for name in [name for name in values if name.startswith("train.out.conv_net.")]:
        found.close(name, state[name.removeprefix("train.out.")], values[name], TOLERANCE)
    gradients = {names[name]: parameter.grad for name, parameter in network.named_parameters()}
    for name in [name for name in values if name.startswith("train.grad.")]:
        # Fourteen batch norms and ReLUs back, the first layer's gradient in float64 is 0.4 % from the recorded one, in
        # float32 on another processor 1.03 %.
        bound = max(TOLERANCE, 0.02 * float(values[name].abs().max()))
        found.close(name, gradients[name.removeprefix("train.grad.")], values[name], bound)
    network.eval()
