# SPDX-License-Identifier: MIT
"""Names of our tensors in RoITr's published checkpoints, and what else these contain."""

from __future__ import annotations

import re
from collections.abc import Iterable

_LOCAL = (
    (r"\.(query|key|value)\.", lambda m: f".transformer.attention.proj_{m[1][0]}."),
    (r"\.position\.", ".transformer.attention.proj_p."),
    (r"\.position_value\.", ".transformer.attention.proj_vp."),
    (r"\.(linear|norm)\.", r".transformer.\1."),
    (r"\.code\.", ".embedding.proj."),
)
_GLOBAL = (
    (r"^transformer\.out\.", "out_proj."),
    (r"^transformer\.in_proj\.", "in_proj."),
    (r"^transformer\.embedding\.frequency$", "embedding.embedding.div_term"),
    (r"^transformer\.embedding\.distance\.", "embedding.proj_d."),
    (r"^transformer\.embedding\.angle\.", "embedding.proj_a."),
    (r"^(transformer\.layers\.\d+)\.attention\.(query|key|value)\.", lambda m: f"{m[1]}.{_inner(m[2][0])}"),
    (r"^(transformer\.layers\.\d+)\.attention\.structure\.", lambda m: f"{m[1]}.{_inner('p')}"),
    (r"^(transformer\.layers\.\d+)\.attention\.position_value\.", lambda m: f"{m[1]}.{_inner('vp')}"),
    (r"^(transformer\.layers\.\d+)\.(linear|norm)\.", r"\1.attention.\2."),
    (r"^(transformer\.layers\.\d+)\.position_(linear|norm)\.", r"\1.attention.pos_\2."),
    (r"^(transformer\.layers\.\d+)\.feed_forward\.", r"\1.output."),
    (r"^(transformer\.layers\.\d+)\.position_feed_forward\.", r"\1.pos_proj."),
)
_UP = {"linear": "linear1.0", "norm": "linear1.1", "mean": "linear2.0"}
_UP |= {"coarse_linear": "linear2.0", "coarse_norm": "linear2.1"}


def official_name(name: str) -> str:
    """The checkpoint's name of one tensor of our state dict."""
    if name.startswith("transformer."):
        for pattern, replacement in _GLOBAL:
            name, found = re.subn(pattern, replacement, name)
            if found:
                break
        return f"backbone.global_transformer.{name}"
    if name.startswith("transport."):
        return name.replace("transport.", "optimal_transport.")
    if not name.startswith("backbone."):
        return name  # coarse_proj, fine_proj
    _, part, level, rest = name.split(".", 3)
    stage = f"backbone.{part[:3]}{int(level) + 1}"
    if rest.startswith("abstraction."):
        return f"{stage}.0.transformer.{_local(rest.removeprefix('abstraction.'))}"
    if rest.startswith("up."):
        _, layer, kind = rest.split(".")
        return f"{stage}.0.{_UP[layer]}.{kind}"
    # Blocks of the encoder count from 1, after the abstraction layer; the decoder has one.
    number, inner = (1, rest.removeprefix("block.")) if part == "decoder" else _numbered(rest)
    if inner.startswith("norm."):
        return f"{stage}.{number}.bn2.{inner.removeprefix('norm.')}"
    return f"{stage}.{number}.transformer.transformer.{_local(inner.removeprefix('attention.'))}"


def unused_names(ours: Iterable[str]) -> list[str]:
    """What a checkpoint contains and the original's forward pass never reads, for a network with our tensors
    ``ours``."""
    codes = [official_name(name) for name in ours if name.endswith(".code.weight")]
    sines = [name.replace(".embedding.proj.weight", ".embedding.embedding.div_term") for name in codes]
    return [*sines, "OT.alpha", "backbone.occ_proj.weight", "backbone.occ_proj.bias"]


def _numbered(rest: str) -> tuple[int, str]:
    _, block, inner = rest.split(".", 2)
    return int(block) + 1, inner


def _local(name: str) -> str:
    name = f".{name}"
    for pattern, replacement in _LOCAL:
        name, found = re.subn(pattern, replacement, name)
        if found:
            break
    return name[1:]


def _inner(letter: str) -> str:
    return f"attention.attention.proj_{letter}."
