# SPDX-License-Identifier: MIT
"""What every network offers beside its computation: sizes by name, and weights that are written and read."""

from __future__ import annotations

import os
from abc import abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar

from torch import nn

from hybridreg.learned.untrained import untrained_parts
from hybridreg.learned.weights import from_pretrained, save_pretrained

if TYPE_CHECKING:
    from typing_extensions import Self


class Pretrained(nn.Module):
    """A network of `hybridreg.learned.network_table`.

    A subclass is made from a configuration alone, offers ``forward(batch)`` without a truth and ``losses(output,
    targets)``, and says:

    Attributes
    ----------
    name : its entry in the table
    config_type : the class of its configuration, with ``to_dict`` and ``from_dict``
    sizes : names that `named_config` knows
    """

    name: ClassVar[str]
    config_type: ClassVar[Any]
    sizes: ClassVar[tuple[str, ...]]
    config: Any

    @staticmethod
    @abstractmethod
    def named_config(name: str) -> Any:
        """The configuration of a size; ``KeyError`` lists the known ones."""

    @classmethod
    def named(cls, size: str, **parts: Any) -> Self:
        """A network of random weights of a size by name; ``KeyError`` lists the known ones."""
        return cls(cls.named_config(size, **parts))

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
            A damaged file, another network's, or a wrong tensor: it is named.
        """
        found = from_pretrained(name_or_folder, cls.name)
        assert isinstance(found, cls)
        return found

    def save_pretrained(self, folder: str | os.PathLike[str], *, half: bool = False) -> None:
        """Write ``config.json`` and ``model.safetensors``, each whole or not at all; ``half`` stores float16."""
        save_pretrained(self, folder, half=half)

    def untrained(self) -> frozenset[str]:
        """Names of the parts that no training step has touched."""
        return untrained_parts(self)

    @abstractmethod
    def memory(self, batch: Any) -> int:
        """Predicted peak of a forward pass in bytes, beside what the process and the batch hold already."""
