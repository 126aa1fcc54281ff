# SPDX-License-Identifier: MIT
"""Names of our tensors in GeoTransformer's published checkpoints."""

from __future__ import annotations

import re

_HEAD_RULES = (
    (r"^transport\.", "optimal_transport."),
    (r"^in_proj\.", "transformer.in_proj."),
    (r"^transformer\.out\.", "transformer.out_proj."),
    (r"^transformer\.embedding\.frequency$", "transformer.embedding.embedding.div_term"),
    (r"^transformer\.embedding\.distance\.", "transformer.embedding.proj_d."),
    (r"^transformer\.embedding\.angle\.", "transformer.embedding.proj_a."),
    (
        r"^transformer\.layers\.(\d+)\.attention\.query\.",
        r"transformer.layers.\1.attention.attention.proj_q.",
    ),
    (r"^transformer\.layers\.(\d+)\.attention\.key\.", r"transformer.layers.\1.attention.attention.proj_k."),
    (
        r"^transformer\.layers\.(\d+)\.attention\.value\.",
        r"transformer.layers.\1.attention.attention.proj_v.",
    ),
    (
        r"^transformer\.layers\.(\d+)\.attention\.structure\.",
        r"transformer.layers.\1.attention.attention.proj_p.",
    ),
    (r"^transformer\.layers\.(\d+)\.(linear|norm)\.", r"transformer.layers.\1.attention.\2."),
    (r"^transformer\.layers\.(\d+)\.feed_forward\.", r"transformer.layers.\1.output."),
    (r"^transformer\.layers\.", "transformer.transformer.layers."),
)
_BACKBONE_RULES = (
    (r"\.conv\.kernel$", ".KPConv.kernel_points"),
    (r"\.conv\.", ".KPConv."),
    (r"\.unary_in\.", ".unary1."),
    (r"\.unary_out\.", ".unary2."),
    (r"\.linear\.(weight|bias)$", r".mlp.\1"),
    (r"\.norm\.(weight|bias)$", r".norm.norm.\1"),
    (r"\.decoder\.(\d+)\.(weight|bias)$", r".decoder.\1.mlp.\2"),  # the last decoder is a bare linear layer
    # A residual block calls the norm behind its convolution norm_conv; the first block of all just norm.
    (r"\.encoder\.(?!0\.0\.)(\d+)\.(\d+)\.norm\.", r".encoder.\1.\2.norm_conv."),
)


def official_name(name: str) -> str:
    """The checkpoint's name of one tensor of our state dict (GeoTransformer, without OMP and VGAM)."""
    in_backbone = name.startswith("backbone.")
    for pattern, replacement in _BACKBONE_RULES if in_backbone else _HEAD_RULES:
        name = re.sub(pattern, replacement, name)
    # Stages and blocks count from 1 in the checkpoints.
    name = re.sub(r"\.encoder\.(\d+)\.(\d+)\.", lambda m: f".encoder{int(m[1]) + 1}_{int(m[2]) + 1}.", name)
    return re.sub(r"\.decoder\.(\d+)\.", lambda m: f".decoder{int(m[1]) + 1}.", name)
