# SPDX-License-Identifier: MIT
"""Names of our tensors in SphereNet's published checkpoint, and what else it contains."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridreg.learned.vrhcf.network import SphereNet

_NORM = ("running_mean", "running_var", "num_batches_tracked")
_LEFT_OVER = [
    f"{norm}.{name}" for norm in ("bn_xyz_raising", "bn_mapping") for name in ("weight", "bias", *_NORM)
]
UNUSED = (*_LEFT_OVER, "xyz_raising.weight", "xyz_raising.bias")


def official_names(network: SphereNet) -> dict[str, str]:
    """The checkpoint's name of each of our tensors: there convolutions, norms and activations are numbered together."""
    names: dict[str, str] = {}
    place = 0
    for index, layer in enumerate(network.layers):
        names |= {f"layers.{index}.conv.{n}": f"conv_net.ops.{place}.{n}" for n in ("weight", "bias")}
        place += 1
        if layer.norm is not None:
            names |= {f"layers.{index}.norm.{n}": f"conv_net.ops.{place}.{n}" for n in _NORM}
            place += 1
        place += bool(layer.relu)
    return names
