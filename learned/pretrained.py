# SPDX-License-Identifier: MIT
"""The base class of all networks: sizes by name, and weights that are written and read."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from torch import nn

from hybridreg.learned.losses.loss_parts import Losses
from hybridreg.learned.true_pair import TruePair
from hybridreg.learned.untrained import untrained_parts
from hybridreg.learned.weights import from_pretrained, save_pretrained

if TYPE_CHECKING:
    from typing_extensions import Self


class Pretrained(nn.Module):
    """A network of `hybridreg.learned.network_table`.

    A subclass is built from a configuration alone, offers ``forward(batch)`` without the ground truth, and defines:

    Attributes
    ----------
    name : its entry in the table
    config_type : the class of its configuration, with ``to_dict`` and ``from_dict``
    sizes : names that `named_config` knows
    loss_names : names of the parts of its losses
    together : whether the examples of a training step are processed at once, joined by `collate`
    mixed : whether it can be trained in bfloat16: not where distances of points are computed in the network
    validated_with : fields of its stage while it is validated in training
    """

    name: ClassVar[str]
    config_type: ClassVar[Any]
    sizes: ClassVar[tuple[str, ...]]
    loss_names: ClassVar[tuple[str, ...]]
    together: ClassVar[bool] = False
    mixed: ClassVar[bool] = False
    validated_with: ClassVar[Mapping[str, Any]] = {}
    config: Any

    @staticmethod
    @abstractmethod
    def named_config(name: str) -> Any:
        """The configuration of a size; ``KeyError`` lists the known ones."""

    @classmethod
    def named(cls, size: str, **parts: Any) -> Self:
        """A network with random weights of a size by name; ``KeyError`` lists the known ones."""
        return cls(cls.named_config(size, **parts))

    @classmethod
    def seeded(cls, config: Any, seed: int) -> Self:
        """A network with random weights; ``seed`` fixes what does not follow torch's generator."""
        return cls(config)

    @classmethod
    @abstractmethod
    def load_official(cls, path: str | os.PathLike[str], size: Any = None) -> Self:
        """The network of a checkpoint that its authors published, in evaluation mode, read with ``weights_only``.

        Parameters
        ----------
        path
            A file of ``torch.save`` as published, or a bare state dict.
        size
            A configuration or its name; None finds it from the tensors.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """

    @classmethod
    def from_pretrained(cls, name_or_folder: str | os.PathLike[str]) -> Self:
        """The network of a folder, or of weights that come with the package, in evaluation mode.

        Raises
        ------
        FileNotFoundError
            No such folder and no such name; the message lists the names.
        ValueError
            A damaged file, one of another network, or a wrong tensor: it is named.
        """
        found = from_pretrained(name_or_folder, cls.name)
        assert isinstance(found, cls)
        return found

    def save_pretrained(self, folder: str | os.PathLike[str], *, half: bool = False) -> None:
        """Write ``config.json`` and ``model.safetensors``, each whole or not at all; ``half`` stores float16."""
        save_pretrained(self, folder, half=half)

    @staticmethod
    def example(pair: TruePair, config: Any, rng: np.random.Generator) -> tuple[Any, Any]:
        """Batch and targets of a training step, on the CPU; ``rng`` makes all random choices.

        Raises
        ------
        ValueError
            A pair that nothing can be learned from.
        """
        raise NotImplementedError

    @staticmethod
    def collate(examples: Sequence[tuple[Any, Any]]) -> tuple[Any, Any]:
        """Several examples joined into one."""
        raise NotImplementedError

    def training_output(self, batch: Any) -> Any:
        """The part of a forward pass that `losses` needs."""
        return self(batch)

    def losses(self, output: Any, targets: Any) -> Losses:
        """Losses of a training step, ready for ``backward``."""
        raise NotImplementedError

    @property
    def voxel(self) -> float | None:
        """Voxel (m) at which it takes clouds; None where there is none."""
        backbone = getattr(self.config, "backbone", self.config)
        return getattr(backbone, "voxel", None)

    def untrained(self) -> frozenset[str]:
        """Names of the parts that no training step has touched."""
        return untrained_parts(self)

    @abstractmethod
    def memory(self, batch: Any) -> int:
        """Predicted peak of a forward pass in bytes, on top of what the process and the batch already hold."""
