# SPDX-License-Identifier: MIT
"""Training recipes, from data to schedule: frozen dataclasses filled from a TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from hybridreg.config import limits
from hybridreg.learned.losses.infonce_loss import InfoNceConfig
from hybridreg.learned.network_table import DEFAULT, network_class
from hybridreg.learned.training.data.augmentation import Augmentation


@dataclass(frozen=True, kw_only=True)
class Source:
    """One data set to learn from or to validate on.

    Attributes
    ----------
    data : text for ``hybridreg.data.open_dataset``
    name : how phases and tables refer to it; the data's own text if empty
    weight : share of the samples that come from here, relative to the other sources
    pairs : use only the first ones, up to this number; 0 for all
    prepared : prepare all pairs once and store them on disk; false generates and prepares them when needed
    """

    data: str
    name: str = ""
    weight: float = 1.0
    pairs: int = 0
    prepared: bool = True

    def __post_init__(self) -> None:
        limits.at_least(self, 0, "pairs")

    @property
    def title(self) -> str:
        """How the source is called."""
        return self.name or self.data


@dataclass(frozen=True, kw_only=True)
class DataPlan:
    """Sources of the pairs. ``loaders`` processes prepare samples ahead of the loop; 0 does it in the loop."""

    train: tuple[Source, ...]
    val: tuple[Source, ...] = ()
    loaders: int = 0

    def __post_init__(self) -> None:
        for kind, sources in (("train", self.train), ("val", self.val)):
            titles = [source.title for source in sources]
            if len(set(titles)) < len(titles):
                raise ValueError(f"data.{kind}: two sources of one name in {titles}; give each its own")
        limits.at_least(self, 0, "loaders")
        if not self.train:
            raise ValueError("data.train is empty: give at least one source")


@dataclass(frozen=True, kw_only=True)
class LossWeights:
    """Weights of the losses; one of weight 0 is not computed."""

    infonce: float = 0.0
    coarse: float = 1.0
    fine: float = 1.0
    mask: float = 1.0

    @property
    def matcher(self) -> bool:
        """Whether any part beyond the backbone is trained."""
        return bool(self.coarse or self.fine or self.mask)


@dataclass(frozen=True, kw_only=True)
class Phase:
    """One phase of training with its own optimiser.

    Attributes
    ----------
    steps, epochs : length; exactly one of the two. An epoch shows as many samples as there are training pairs
    rate : peak learning rate
    warmup : steps over which the rate rises linearly from 0
    decay : "linear" to 0 at the end; "step" by ``decay_factor`` every ``decay_every`` steps (or epochs)
    momentum : of "sgd", without dampening; the others have their own
    backbone_rate : factor on the rate of the backbone; 0 freezes it
    data : weights of sources by name, instead of their own; sources left out are not used
    accumulate : pairs of one optimiser step, over all processes together
    packed : pairs whose clouds go through the backbone at once, for a GPU; the gradients are the same but for rounding
    use_predicted : how often a step sees the predicted overlap mask (docs/methods.md 5.4)
    """

    name: str
    steps: int = 0
    epochs: float = 0.0
    rate: float = 1e-4
    warmup: int = 0
    decay: Literal["linear", "step", "none"] = "none"
    decay_every: float = 0.0
    decay_factor: float = 0.95
    optimizer: Literal["adamw", "adam", "sgd"] = "adamw"
    momentum: float = 0.9
    weight_decay: float = 1e-6
    losses: LossWeights = field(default_factory=LossWeights)
    backbone_rate: float = 1.0
    data: Mapping[str, float] = field(default_factory=dict)
    accumulate: int = 1
    packed: int = 1
    use_predicted: float = 0.0

    def __post_init__(self) -> None:
        if (self.steps > 0) == (self.epochs > 0):
            raise ValueError(f"phase {self.name!r}: give steps or epochs, above 0, and not both")
        if self.decay == "step" and not self.decay_every > 0:
            raise ValueError(f"phase {self.name!r}: decay='step' needs decay_every above 0")
        if self.accumulate < 1:
            raise ValueError(f"phase {self.name!r}: accumulate={self.accumulate} must be at least 1")
        if self.packed < 1:
            raise ValueError(f"phase {self.name!r}: packed={self.packed} must be at least 1")
        if not 0.0 <= self.momentum < 1.0:
            raise ValueError(f"phase {self.name!r}: momentum={self.momentum} must be at least 0 and below 1")


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A whole training run.

    Attributes
    ----------
    network : the network's complete configuration; plain values of it, as in a card, become one
    kind : the network's name in `hybridreg.learned.network_table`
    start : folder or name of trained weights; tensors of the same names are copied
    every : steps between validations
    log_every : steps between lines of the log
    clip : largest norm of the gradient
    """

    name: str
    network: Any
    data: DataPlan
    phase: tuple[Phase, ...]
    kind: str = DEFAULT
    seed: int = 0
    start: str = ""
    augmentation: Augmentation = field(default_factory=Augmentation)
    infonce: InfoNceConfig = field(default_factory=InfoNceConfig)
    every: int = 500
    log_every: int = 20
    checkpoint_minutes: float = 5.0
    clip: float = 1.0
    precision: Literal["32-true", "bf16-mixed"] = "32-true"

    def __post_init__(self) -> None:
        if isinstance(self.network, Mapping):
            config = network_class(self.kind).config_type.from_dict(self.network)
            object.__setattr__(self, "network", config)
        limits.at_least(self, 0, "seed", "every")
        limits.at_least(self, 1, "log_every")
        if self.precision != "32-true" and not network_class(self.kind).mixed:
            raise ValueError(
                f"precision={self.precision!r}: {self.kind} computes distances of points, which need float32; "
                "choose '32-true'"
            )
        if not self.phase:
            raise ValueError("a recipe needs at least one [[phase]]")
        known = {source.title for source in self.data.train}
        for phase in self.phase:
            unknown = sorted(set(phase.data) - known)
            if unknown:
                raise ValueError(
                    f"phase {phase.name!r}: data names {unknown}; the training sources are {sorted(known)}"
                )
            if self.kind != DEFAULT:
                self._check_other(phase)
            elif phase.packed > 1 and self.network.backbone.norm_scope != "per_cloud":
                raise ValueError(
                    f"phase {phase.name!r}: packed={phase.packed} would normalise several pairs as one; "
                    'choose packed=1, or network.backbone.norm_scope="per_cloud"'
                )
            elif phase.losses.mask and self.network.omp is None and phase.losses.mask != 1.0:
                raise ValueError(f"phase {phase.name!r}: a mask loss is weighed, but the network has no OMP")
        vgam = self.network.vgam if self.kind == DEFAULT else None
        if vgam is not None and vgam.point_position == "radial" and self.augmentation.rotation == "full":
            raise ValueError(
                "network.vgam: point_position='radial' means range and height, which augmentation.rotation='full' "
                "turns into one another; choose point_position='mlp', or rotation='yaw'"
            )

    def _check_other(self, phase: Phase) -> None:
        if phase.losses != LossWeights():
            raise ValueError(
                f"phase {phase.name!r}: losses has the parts of {DEFAULT}'s loss; {self.kind} weighs its own in "
                "[network.loss]"
            )
        if phase.packed > 1:
            raise ValueError(
                f"phase {phase.name!r}: packed is about {DEFAULT}'s backbone; {self.kind} has its own"
            )
        if phase.use_predicted:
            raise ValueError(
                f"phase {phase.name!r}: use_predicted is about OMP's mask, and {self.kind} has none"
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for checkpoints and cards."""
        import dataclasses

        return dataclasses.asdict(self)
