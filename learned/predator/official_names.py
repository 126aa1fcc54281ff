# SPDX-License-Identifier: MIT
"""Names of our tensors in Predator's published checkpoints, and a checkpoint's configuration."""

from __future__ import annotations

import re
from collections.abc import Mapping

from torch import Tensor

from hybridreg.learned.kpfcnn.kpfcnn_names import attention_name, block_name, nearest_config

_RULES = (
    (r"^bottleneck\.", "bottle."),
    (r"^project\.", "proj_gnn."),
    (r"^score\.", "proj_score."),
    (r"^graph\.layers\.(\d+)\.layer\.", r"gnn.layers.\1."),
    (r"^graph\.layers\.(\d+)\.first\.linear\.", r"gnn.layers.\1.conv1."),
    (r"^graph\.layers\.(\d+)\.second\.linear\.", r"gnn.layers.\1.conv2."),
    (r"^graph\.layers\.(\d+)\.join\.", r"gnn.layers.\1.conv3."),
)


def official_name(name: str) -> str:
    """The checkpoint's name of one tensor of our state dict."""
    for pattern, replacement in _RULES:
        name = re.sub(pattern, replacement, name)
    return block_name(attention_name(name))


def config_name(tensors: Mapping[str, Tensor], origin: str) -> str:
    """Name of the published configuration of a checkpoint, by the radius of its first kernel points.

    Raises
    ------
    ValueError
        No such tensor: not a checkpoint of this network.
    """
    key = "encoder_blocks.0.KPConv.kernel_points"
    return nearest_config(tensors, key, {"predator-kitti": 1.275, "predator-3dmatch": 0.0625}, origin)
