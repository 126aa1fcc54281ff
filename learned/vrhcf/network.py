# SPDX-License-Identifier: MIT
"""SphereNet: descriptors of patches from convolutions on spherical voxels."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.checkpoints import read_checkpoint
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.vrhcf.batch import SphereBatch
from hybridreg.learned.vrhcf.config import SIZES, ShellConv, SphereNetConfig, SurfaceConv, named_config
from hybridreg.learned.vrhcf.cost import CHUNK, forward_bytes
from hybridreg.learned.vrhcf.examples import example
from hybridreg.learned.vrhcf.losses import SphereLosses, losses
from hybridreg.learned.vrhcf.official_names import UNUSED, official_names
from hybridreg.learned.vrhcf.spherical_voxels import counts, spherical, voxels
from hybridreg.learned.vrhcf.targets import SphereTargets
from hybridreg.learned.vrhcf.upright_frames import reference_axes, upright_rotations
from hybridreg.learned.weights import load_official_tensors


@dataclass(frozen=True, kw_only=True)
class SphereOutput:
    """Descriptors of both clouds' keypoints, not normalised."""

    target: Tensor  # (m, d)
    source: Tensor  # (n, d)


class SphereLayer(nn.Module):
    """Padding, convolution, batch norm without affine parameters, ReLU."""

    def __init__(self, plan: ShellConv | SurfaceConv, in_dim: int, *, wraps_azimuth: bool) -> None:
        super().__init__()
        self.wraps_azimuth = wraps_azimuth
        self.norm: nn.Module | None = None
        if isinstance(plan, ShellConv):
            self.relu, self.reach = True, plan.kernel
            self.conv: nn.Module = nn.Conv3d(in_dim, plan.width, plan.kernel)
            self.norm = nn.BatchNorm3d(plan.width, affine=False)
            return
        self.relu, self.reach = plan.relu, 1 + (plan.kernel - 1) * plan.dilation
        self.conv = nn.Conv2d(in_dim, plan.width, plan.kernel, dilation=plan.dilation)
        if plan.norm:
            self.norm = nn.BatchNorm2d(plan.width, affine=False)

    def forward(self, x: Tensor) -> Tensor:
        """(n, c, [radial,] azimuth, elevation) to the same but for channels and shells."""
        x = self.convolved(x)
        x = x if self.norm is None else self.norm(x)
        return torch.relu(x) if self.relu else x

    def convolved(self, x: Tensor) -> Tensor:
        """The convolution's output before norm and ReLU."""
        return self.conv(pad_sphere(x, self.reach, wraps_azimuth=self.wraps_azimuth))


def pad_sphere(x: Tensor, reach: int, *, wraps_azimuth: bool) -> Tensor:
    """Widen the last two axes (azimuth, elevation) for a kernel that covers ``reach`` cells.

    One axis wraps around, the other gets zeros: azimuth and elevation, or, as released, the other way round. A kernel
    of an even reach is padded only at the end, by half of it. A sphere with fewer cells than that is wrapped several
    times.
    """
    before, after = (0, reach // 2) if reach % 2 == 0 else ((reach - 1) // 2,) * 2
    around, flat = (-2, -1) if wraps_azimuth else (-1, -2)
    size = x.shape[around]
    if max(before, after) > size:
        rows = torch.arange(-before, size + after, device=x.device) % size
        x = x.index_select(x.dim() + around, rows)
    elif after:  # the same in three copies, ten times as fast
        x = torch.cat([x.narrow(around, size - before, before), x, x.narrow(around, 0, after)], around)
    return F.pad(x, (before, after) if flat == -1 else (0, 0, before, after))


class SphereNet(Pretrained):
    """The descriptor (ThreeDMatch/model.py). No part of it takes the ground truth.

    Parameters
    ----------
    config
        The network; `hybridreg.learned.vrhcf.config.named_config` has those by name. Its docstring says in which
        points the released behaviour differs from the correct one.
    """

    name: ClassVar[str] = "vrhcf"
    mixed: ClassVar[bool] = True
    config_type: ClassVar[type] = SphereNetConfig
    sizes: ClassVar[tuple[str, ...]] = tuple(SIZES)
    loss_names: ClassVar[tuple[str, ...]] = ("hardest",)
    named_config = staticmethod(named_config)
    example = staticmethod(example)
    # All keypoints of a cloud would take longer than the steps between two validations.
    validated_with: ClassVar[Mapping[str, Any]] = {"max_keypoints": 500}

    def __init__(self, config: SphereNetConfig) -> None:
        super().__init__()
        self.config = config
        plans: list[ShellConv | SurfaceConv] = [*config.shells, *config.surface]
        widths = (1, *(plan.width for plan in plans))
        wraps = config.padding == "right"
        self.layers = nn.ModuleList(
            SphereLayer(plan, width, wraps_azimuth=wraps)
            for plan, width in zip(plans, widths[:-1], strict=True)
        )

    @classmethod
    def load_official(
        cls, path: str | os.PathLike[str], size: SphereNetConfig | str | None = None
    ) -> SphereNet:
        """The published checkpoint (pretrain/3DMatch_best.pkl), in evaluation mode, read with ``weights_only``.

        Parameters
        ----------
        path
            A file of ``torch.save`` that holds a state dict, its names with or without the wrapper's ``module.``.
        size
            A configuration or its name; by default ``vrhcf-3dmatch``, with everything as released. A ``padding`` other
            than "released" does not fit what these weights were trained with.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        tensors = read_checkpoint(path).tensors
        size = size or "vrhcf-3dmatch"
        network = cls(named_config(size) if isinstance(size, str) else size)
        load_official_tensors(network, tensors, str(path), official_names(network).__getitem__, UNUSED)
        return network.eval()

    def untrained(self) -> frozenset[str]:
        """Its norms have no parameters: their running statistics show whether it has seen any batch."""
        kept = {name: t for name, t in self.named_buffers() if name.endswith(("running_mean", "running_var"))}
        fresh = all(bool(t.eq(1.0 if name.endswith("var") else 0.0).all()) for name, t in kept.items())
        return frozenset({"layers"}) if kept and fresh else frozenset()

    def forward(self, batch: SphereBatch) -> SphereOutput:
        """Descriptors of all patches of a pair: the source's first, which matters to batch norm in training."""
        source = self.describe(batch.source)
        return SphereOutput(target=self.describe(batch.target), source=source)

    def losses(self, output: SphereOutput, targets: SphereTargets) -> SphereLosses:
        """The training loss of an output (`hybridreg.learned.vrhcf.losses.losses`)."""
        return losses(self.config, output, targets)

    def memory(self, batch: SphereBatch) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
        return forward_bytes(self.config, max(len(batch.target), len(batch.source)))

    def describe(self, patches: Tensor) -> Tensor:
        """Descriptors (n, d) of patches (n, k, 3) whose last row is the keypoint; not normalised."""
        local = self.local_points(patches)
        # In training the norms' statistics are over all patches of a cloud: no chunks.
        blocks = [local] if self.training else local.split(CHUNK)
        found = [self.surface(self.voxelise(block)).amax((2, 3)) for block in blocks]
        return torch.cat(found) if found else local.new_zeros(0, self.config.width)

    def local_points(self, patches: Tensor) -> Tensor:
        """Patches (n, k, 3) about their keypoints, aligned with their axis unless ``local_frame`` is "none"."""
        keypoints = patches[:, -1]
        centred = patches - keypoints[:, None]
        if self.config.local_frame == "none" or len(patches) == 0:
            return centred
        return centred @ self.rotations(patches)

    def rotations(self, patches: Tensor) -> Tensor:
        """Rotations (n, 3, 3) of patches (n, k, 3), ``local = centred @ R``."""
        keypoints = patches[:, -1]
        axes = reference_axes(patches - keypoints[:, None], keypoints)
        return upright_rotations(axes, self.config.frames, self.config.frame_batch)

    def voxelise(self, local: Tensor) -> Tensor:
        """Local points (n, k, 3) to (n, 1, radial, azimuth, elevation)."""
        config = self.config
        spread = voxels if config.interpolated else counts
        grid = (config.radial, config.azimuth, config.elevation)
        return spread(spherical(local), config.radius, grid)[:, None]

    def surface(self, x: Tensor) -> Tensor:
        """The convolutions: (n, 1, radial, azimuth, elevation) to (n, d, azimuth, elevation)."""
        for index, layer in enumerate(self.layers):
            x = layer(self.flattened(index, x))
        return x

    def flattened(self, index: int, x: Tensor) -> Tensor:
        """The input of layer ``index``: the single remaining shell is squeezed before the first 2-D layer."""
        return x[:, :, 0] if index == len(self.config.shells) else x
