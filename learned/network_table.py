# SPDX-License-Identifier: MIT
"""The networks by name: the only place where loading, stages, training and listings learn which there are."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridreg.learned.pretrained import Pretrained

# The network of a config.json or a recipe without the key "network".
DEFAULT = "cross3dreg"

# Class of each network; a config.json names it under "network".
NETWORKS = {
    DEFAULT: "hybridreg.learned.cross3dreg.network:RegistrationNetwork",
    "fcgf": "hybridreg.learned.fcgf.network:FcgfNetwork",
    "predator": "hybridreg.learned.predator.network:PredatorNetwork",
    "cofinet": "hybridreg.learned.cofinet.network:CofinetNetwork",
    "omnet": "hybridreg.learned.omnet.network:OmnetNetwork",
    "roitr": "hybridreg.learned.roitr.network:RoitrNetwork",
    "vrhcf": "hybridreg.learned.vrhcf.network:SphereNet",
}


def network_class(name: str) -> type[Pretrained]:
    """The class of a network.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in NETWORKS:
        raise KeyError(f"unknown network {name!r}; known are {', '.join(NETWORKS)}")
    module, _, attribute = NETWORKS[name].partition(":")
    found: type[Pretrained] = getattr(import_module(module), attribute)
    return found
