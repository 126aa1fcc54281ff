# SPDX-License-Identifier: MIT
"""Names of our tensors in OMNet's published checkpoints, and the configuration from a checkpoint's shapes."""

from __future__ import annotations

import re
from collections.abc import Mapping

from torch import Tensor

from hybridreg.learned.omnet.config import OmnetConfig


def official_name(name: str, decoder_layers: int = 3) -> str:
    """The checkpoint's name of one tensor of our state dict; the class layer counts after the decoder's others."""
    name = name.replace(".classes.", f".conv_block{decoder_layers + 1}.0.")
    name = re.sub(r"^(regression\.\d+)\.pose\.", r"\1.final_fc.0.", name)

    def layer(found: re.Match[str]) -> str:
        block = "fc_block" if found[1] == "regression" else "conv_block"
        return f"{found[1]}.{found[2]}.{block}{int(found[3]) + 1}.{0 if found[4] == 'linear' else 1}."

    return re.sub(r"^(\w+)\.(\d+)\.layers\.(\d+)\.(linear|norm)\.", layer, name)


def config_of(tensors: Mapping[str, Tensor], origin: str) -> OmnetConfig:
    """Configuration of a checkpoint from its shapes.

    Raises
    ------
    ValueError
        The first iteration lacks a part: these are not weights of OMNet.
    """

    def widths(part: str, block: str) -> tuple[int, ...]:
        found: list[int] = []
        while (
            weight := tensors.get(f"{part}.0.{block}{len(found) + 1}.0.weight")
        ) is not None and weight.dim() >= 2:
            found.append(weight.shape[0])
        if not found:
            raise ValueError(
                f"{origin}: tensor {part}.0.{block}1.0.weight is missing, or not a matrix: no weights of OMNet"
            )
        return tuple(found)

    iterations = 1
    while f"encoder.{iterations}.conv_block1.0.weight" in tensors:
        iterations += 1
    return OmnetConfig(
        encoder=widths("encoder", "conv_block"),
        fusion=widths("fusion", "conv_block"),
        decoder=widths("decoder", "conv_block")[:-1],
        regression=widths("regression", "fc_block"),
        iterations=iterations,
    )
