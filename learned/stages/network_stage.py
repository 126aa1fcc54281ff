# SPDX-License-Identifier: MIT
"""The common part of stages that run a network: the location of its weights, and its device."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from hybridreg.io import shipped_weights
from hybridreg.runtime.threads import single
from hybridreg.runtime.torch_settings import as_torch_begins
from hybridreg.stage import Stage

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridreg.learned.stages.networks import Loaded, NetworkName
    from hybridreg.scene import Scene

Value = TypeVar("Value")


@dataclass(frozen=True, kw_only=True)
class NetworkStage(Stage):
    """A stage that runs the network that ``kind`` names in `hybridreg.learned.network_table`.

    Parameters
    ----------
    weights : str or None
        A folder that `save_pretrained` wrote, the name of weights that come with the package, or a checkpoint that
        the network's authors published (`.pth`, `.tar`, `.pkl`). Where none are named those of the package are taken
        (``NAME-small``); with a ``size``, or ``untrained``, None means random weights.
    size : str or None
        Configuration by name (`hybridreg list networks`): of random weights ("nano" if not given), or of a checkpoint
        (found from its tensors if not given). Folders contain their own.
    device : str
        In torch's notation: "cpu", "cuda", "cuda:1".
    untrained : bool
        Run even though the weights are random.
    """

    weights: str | None = None
    size: str | None = None
    device: str = "cpu"
    untrained: bool = False

    kind: ClassVar[str] = "cross3dreg"
    # Weights of the package that the stage takes where neither weights nor a size are given.
    shipped: ClassVar[str] = ""
    # Parts that must have been trained, and whether a network with random weights uses images.
    parts: ClassVar[frozenset[str]] = frozenset({"backbone"})
    image: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if isinstance(self.weights, os.PathLike):
            object.__setattr__(self, "weights", os.fspath(self.weights))
        if type(self.device).__module__ == "torch":  # a torch.device
            object.__setattr__(self, "device", str(self.device))
        super().__post_init__()
        if self.weights is not None:
            return
        if self.size is None and not self.untrained and self.shipped in shipped_weights.names():
            object.__setattr__(self, "weights", self.shipped)
        elif not self.untrained:
            raise ValueError(
                f"{type(self).__name__}: without weights=... these weights are random; name a folder or weights "
                "that come with the package, or insist with untrained=True"
            )

    @classmethod
    def from_pretrained(cls, name_or_folder: str | os.PathLike[str], **fields: Any) -> Self:
        """Stage with trained weights, which are read at once so that a wrong file is reported here.

        Raises
        ------
        FileNotFoundError
            No such folder and no such name.
        ValueError
            Damaged weights, weights of another network, or random ones.
        """
        stage = cls(weights=os.fspath(name_or_folder), **fields)
        stage.network()
        return stage

    @classmethod
    def load_official(cls, path: str | os.PathLike[str], **fields: Any) -> Self:
        """Stage with a checkpoint that the network's authors published, read at once.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        return cls.from_pretrained(path, **fields)

    def save_pretrained(self, folder: str | os.PathLike[str]) -> None:
        """Write the network's weights and configuration into a folder."""
        self.network().save_pretrained(folder)

    def network(self) -> Any:
        """The network in evaluation mode, of the class that ``kind`` names, read on first access.

        Raises
        ------
        ValueError
            As `from_pretrained`.
        """
        network = self._load().network
        self.check(network)
        random = self.random_parts()
        if random and not self.untrained:
            raise ValueError(
                f"{type(self).__name__}: these weights are random: {', '.join(random)} of {self.weights!r} was never "
                "trained; name other weights, or insist with untrained=True"
            )
        return network

    def random_parts(self) -> list[str]:
        """The parts of this stage that were never trained."""
        return sorted(self.parts & self._load().untrained)

    def note_random(self, scene: Scene) -> None:
        """Leave a note where this stage runs with random weights."""
        if self.random_parts():
            scene.note(f"{type(self).__name__} ran with random weights (untrained=True)")

    def sees(self) -> bool:
        """Whether the network has learned to use images. An entirely random one counts as if it had."""
        loaded = self._load()
        blind = "image_encoder" in loaded.untrained and "backbone" not in loaded.untrained
        return getattr(loaded.network, "image_encoder", None) is not None and not blind

    def _load(self) -> Loaded:
        from hybridreg.learned.stages.networks import load

        return load(self.network_name())

    @staticmethod
    @contextmanager
    def inference() -> Iterator[None]:
        """Without gradients, in one thread and as torch begins (`hybridreg.runtime`): for all that a network does."""
        import torch

        with single(), as_torch_begins(), torch.inference_mode():
            yield

    def once(self, scene: Scene, run: Callable[[], Value]) -> Value:
        """What the network makes of a pair: `run()`, once a run for all stages of the same network."""
        self.note_random(scene)
        return scene.shared(self.network_name(), run)

    def network_name(self) -> NetworkName:
        """Identity of this stage's network; stages with equal names share one encoding of a pair."""
        from hybridreg.learned.stages.networks import NetworkName

        image = self.weights is None and self.image
        return NetworkName(self.kind, self.weights, self.size, self.device, image, self.told())

    def told(self) -> tuple[tuple[str, Any], ...]:
        """What a published checkpoint does not contain, as arguments of the network's `load_official`."""
        return ()

    def check(self, network: Any) -> None:
        """Refuse a network that lacks a part that this stage runs."""
