# SPDX-License-Identifier: MIT
"""Names in their checkpoints of the parts that Predator and CoFiNet share."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from torch import Tensor

_BLOCKS = (
    (r"\bencoder\.blocks\.", "encoder_blocks."),
    (r"\bdecoder\.blocks\.", "decoder_blocks."),
    (r"\.conv\.kernel$", ".KPConv.kernel_points"),
    (r"\.conv\.weights$", ".KPConv.weights"),
    (r"\.unary_in\.linear\.", ".unary1.mlp."),
    (r"\.unary_out\.linear\.", ".unary2.mlp."),
    (r"\.unary_shortcut\.linear\.", ".unary_shortcut.mlp."),
    (r"(decoder_blocks\.\d+)\.(?:linear\.)?weight$", r"\1.mlp.weight"),
)
_ATTENTION = (
    (r"\.attention\.query\.", ".attn.proj.0."),
    (r"\.attention\.key\.", ".attn.proj.1."),
    (r"\.attention\.value\.", ".attn.proj.2."),
    (r"\.attention\.merge\.", ".attn.merge."),
    (r"\.expand\.", ".mlp.0."),
    (r"\.squeeze\.", ".mlp.3."),  # 1 and 2 are the normalisation and the ReLU
)


def block_name(name: str) -> str:
    """The checkpoint's name of a tensor of encoder or decoder."""
    return _renamed(name, _BLOCKS)


def attention_name(name: str) -> str:
    """The checkpoint's name of a tensor of a message layer."""
    return _renamed(name, _ATTENTION)


def nearest_config(tensors: Mapping[str, Tensor], key: str, radii: Mapping[str, float], origin: str) -> str:
    """Which of several configurations has the search radius (m) of a layer's kernel points.

    Kernel points lie within the radius, the outer ones at two thirds of it; published radii differ by a factor of 20.

    Raises
    ------
    ValueError
        The checkpoint has no such tensor.
    """
    points = tensors.get(key)
    if points is None:
        raise ValueError(f"{origin}: tensor {key} is missing")
    reach = float(points.double().norm(dim=-1).max())
    if not 0.0 < reach < math.inf:
        raise ValueError(f"{origin}: tensor {key} holds no kernel points: the farthest lies at {reach} m")
    return min(radii, key=lambda name: abs(math.log(radii[name] / reach)))


def _renamed(name: str, rules: tuple[tuple[str, str], ...]) -> str:
    for pattern, replacement in rules:
        name = re.sub(pattern, replacement, name)
    return name
