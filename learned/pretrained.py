# SPDX-License-Identifier: MIT
"""Networks by name, and how those of a folder of their own are written and read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from torch import Tensor

from hybridreg.io.files import read_whole
from hybridreg.io.torch_file import parse_torch
from hybridreg.learned.weights import load_tensors, read_folder, save_pretrained

if TYPE_CHECKING:
    from typing_extensions import Self

# What a config.json calls its network, and where that is. Without the key it is `RegistrationNetwork`.
NETWORKS = {
    "cofinet": "hybridreg.learned.cofinet.network:CofinetNetwork",
    "fcgf": "hybridreg.learned.fcgf.network:FcgfNetwork",
    "omnet": "hybridreg.learned.omnet.network:OmnetNetwork",
    "predator": "hybridreg.learned.predator.network:PredatorNetwork",
}


def network_class(name: str) -> Any:
    """The class of a network.

    Raises
    ------
    KeyError
        An unknown name; the message lists the known ones.
    """
    if name not in NETWORKS:
        raise KeyError(f"unknown network {name!r}; known are {', '.join(NETWORKS)}")
    module, _, attribute = NETWORKS[name].partition(":")
    return getattr(import_module(module), attribute)


class Pretrained:
    """Weights in a folder: ``config.json``, whose key "network" has the network's name, and ``model.safetensors``."""

    name: ClassVar[str]
    config_type: ClassVar[Any]

    @classmethod
    def from_pretrained(cls, name_or_folder: str | os.PathLike[str]) -> Self:
        """The network of a folder, or of weights that come with the package, in evaluation mode.

        Raises
        ------
        FileNotFoundError
            No such folder and no such name.
        ValueError
            A damaged file, another network's, or a wrong tensor: it is named.
        """
        config, tensors, origin = read_folder(name_or_folder, cls.name, cls.config_type.from_dict)
        network: Any = cls(config)  # type: ignore[call-arg]
        load_tensors(network, tensors, origin)
        network.eval()
        return network

    def save_pretrained(self, folder: str | os.PathLike[str], *, half: bool = False) -> None:
        """Write both files, each whole or not at all; ``half`` stores float16."""
        save_pretrained(self, folder, half=half)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Checkpoint:
    """A published checkpoint: its tensors, and the settings that it was trained with, where the file has them."""

    tensors: dict[str, Tensor]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def number(self, name: str) -> float | None:
        """A positive number among the settings."""
        value = self.settings.get(name)
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0
        return float(value) if is_number else None  # type: ignore[arg-type]


def read_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Read a checkpoint with ``weights_only``: a bare state dict, or one under ``state_dict`` or ``model``.

    The prefix ``module.`` of parallel training is taken off.

    Raises
    ------
    FileNotFoundError
        No such file.
    ValueError
        Damaged, with anything else inside than tensors and plain values, or without a state dict.
    """
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"no checkpoint {os.fspath(path)!r}")
    content = parse_torch(read_whole(file), str(file))
    content = content if isinstance(content, dict) else {}
    state = next(
        (content[key] for key in ("state_dict", "model") if isinstance(content.get(key), dict)), content
    )
    if not state or not all(isinstance(value, Tensor) for value in state.values()):
        raise ValueError(f"{file} holds no state dict, neither at the top nor under 'state_dict' or 'model'")
    settings = content.get("config")
    return Checkpoint(
        {name.removeprefix("module."): tensor for name, tensor in state.items()},
        settings if isinstance(settings, Mapping) else {},
    )
