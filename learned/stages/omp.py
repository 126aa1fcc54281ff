# SPDX-License-Identifier: MIT
"""The overlapping mask predictor as a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Overlap
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork


@dataclass(frozen=True, kw_only=True)
class Omp(NetworkStage):
    """Overlap probabilities of the points from superpoint features and the image (Cross3DReg, section 3.2).

    Each point takes the probability of its superpoint, so that any matcher can use it. A matcher of the same
    weights shares the encoding. Without an image, a network whose OMP does not look at the other cloud knows
    nothing, and every point counts.

    Parameters
    ----------
    as_published : bool
        Insist on the paper's predictor, which looks at the image and at one cloud alone. Random weights are of that
        kind. Trained ones answer from what they were trained with: where that was more, a note says so.
    """

    as_published: bool = False

    image: ClassVar[bool] = True
    parts: ClassVar[frozenset[str]] = frozenset({"backbone", "omp"})

    def __call__(self, scene: Scene) -> Overlap:
        import torch

        from hybridreg.learned.cross3dreg.as_published import mask_inputs_of_ours
        from hybridreg.learned.stages.encoding import encode
        from hybridreg.learned.stages.spreading import spread
        from hybridreg.learned.stages.tensor_values import array

        network: RegistrationNetwork = self.network()
        encoding = encode(scene, self)
        ours = mask_inputs_of_ours(network.config) if self.as_published else []
        if ours:
            scene.note(
                f"the mask is not as published: OMP of {self.weights!r} was trained to look at {' and '.join(ours)} "
                "too; `hybridreg train paper` trains one that does not"
            )
        with self.inference():
            logits = network.predict_overlap(encoding)
            assert logits is not None, "check() lets no network without OMP through"
            if not logits.informed:
                scene.note("OMP has neither an image nor the other cloud to use: every point takes part")
                return Overlap.full(len(scene.source), len(scene.target))
            source, target = array(torch.sigmoid(logits.source)), array(torch.sigmoid(logits.target))
        return Overlap(
            spread(source, array(encoding.source.nodes), scene.source.points),
            spread(target, array(encoding.target.nodes), scene.target.points),
        )

    def check(self, network: RegistrationNetwork) -> None:
        """Refuse weights without an overlapping mask predictor."""
        if network.omp is None:
            raise ValueError(f"Omp: the weights {self.weights!r} hold no overlapping mask predictor")
