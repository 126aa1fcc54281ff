# SPDX-License-Identifier: MIT
"""Names of our tensors in FCGF's published checkpoints, and the configuration from a checkpoint's shapes."""

from __future__ import annotations

import re
from collections.abc import Mapping

from torch import Tensor

from hybridreg.learned.fcgf.config import FcgfConfig


def official_name(name: str) -> str:
    """The checkpoint's name of one tensor of our state dict."""
    name = re.sub(r"^mix\.", "conv1_tr.", name)
    name = re.sub(r"(norm\d?)\.", r"\1.bn.", name)
    # Levels count from 1; the decoder's are named after the level that they come from.
    name = re.sub(r"^encoder\.(\d+)\.([a-z]+)\.", lambda m: f"{m[2]}{int(m[1]) + 1}.", name)
    return re.sub(
        r"^decoder\.(\d+)\.([a-z]+)\.((?:bn)?)",
        lambda m: f"{m[2]}{int(m[1]) + 2}_tr.{m[3]}",
        name,
    )


def config_of(
    tensors: Mapping[str, Tensor], origin: str, *, normalize: bool, voxel: float | None = None
) -> FcgfConfig:
    """Configuration of a checkpoint from its shapes; ``normalize`` and ``voxel`` as in `FcgfNetwork.load_official`.

    Raises
    ------
    ValueError
        A tensor that every such network has is missing, or not a cube: it is named.
    """
    depth = 0
    while f"conv{depth + 1}.kernel" in tensors:
        depth += 1
    if depth < 2:
        raise ValueError(f"{origin}: tensor conv{depth + 1}.kernel is missing; these are not weights of FCGF")

    def shape(name: str) -> tuple[int, ...]:
        if name not in tensors:
            raise ValueError(f"{origin}: tensor {name} is missing")
        if tensors[name].dim() not in (2, 3):
            raise ValueError(
                f"{origin}: tensor {name} has shape {tuple(tensors[name].shape)}, which no kernel has"
            )
        return tuple(tensors[name].shape)

    def edge(name: str) -> int:
        volume = 1 if len(shape(name)) == 2 else shape(name)[0]
        size = round(volume ** (1 / 3))
        if size**3 != volume:
            raise ValueError(
                f"{origin}: tensor {name} has shape {shape(name)}: {volume} offsets are not a cube"
            )
        return size

    levels = range(1, depth + 1)
    first = edge("conv1.kernel")
    return FcgfConfig(
        in_channels=shape("conv1.kernel")[-2],
        out_channels=shape("final.kernel")[-1],
        channels=tuple(shape(f"conv{level}.kernel")[-1] for level in levels),
        tr_channels=tuple(shape(f"conv{level}_tr.kernel")[-1] for level in levels),
        first_kernel=first,
        kernel=edge("conv2.kernel"),
        tr_kernel=edge("conv2_tr.kernel"),
        final_kernel=edge("final.kernel"),
        normalize=normalize,
        voxel=voxel or (0.025 if first == 7 else 0.3),
    )
