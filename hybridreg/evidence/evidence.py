# SPDX-License-Identifier: MIT
"""The facts behind a verdict, as numbers."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import PSEUDO_COUNT, Agreement
from hybridreg.evidence.information import Information

Mask = NDArray[np.bool_]

# Rival margin where there is no rival, and the least that one counts; log-odds, by hand.
NO_RIVAL = -20.0


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What both clouds say about one pose; shares lie between 0 and 1.

    The first group is known of every hypothesis; most of it is weighed by the log-odds (`hybridreg.evidence.log_odds`).
    The second is computed for the pose that is judged: some for the verdict, some only to be reported.
    """

    agreement_least: float  # agreeing share of the visible points that face the axis on which it is least
    agreement_middle: float  # on the axis between
    agreement_most: float  # on the axis where it is most
    looked_least: float  # visible points that face the axis with the fewest
    looked_through: float  # share of the visible points that violate free space, both clouds together
    looked_through_source: float  # of the source's points
    looked_through_target: float  # of the target's points
    agreement_rare: (
        float  # agreeing share of the visible points that do not face the commonest axis (the ground's)
    )
    looked_through_rare: float  # share of these that violates free space
    agreed_rare: float  # how many of these agree
    through_rare: float  # how many violate free space
    relief_cells: float  # cells of ground that both clouds show
    relief_correlation: float  # of their heights, beyond what repeats, between -1 and 1
    weakest: float  # smallest eigenvalue of the information per point, at most 1/3
    found_by: float  # entries that found the pose independently of one another
    matched: float  # largest agreeing share of any matcher's matches; 0 where none ran
    closeness: float  # nats per point by which a rival's points lie closer to the surfaces; at most 0
    overturned: float  # 1 where the pose turns the world upside down or puts a sensor underground, else 0

    support: float = 0.0  # log-odds that the pose is right, were there no other
    rival_margin: float = NO_RIVAL  # log-odds of the best rival less the pose's
    compared: float = 0.0  # points that were compared, of the cloud with fewer; at most 3,000
    visible_source: float = 0.0  # share of the source's points that the target's sensor looked at
    visible_target: float = 0.0  # share of the target's points that the source's sensor looked at
    hidden_source: float = 0.0  # share of the source's points behind a surface of the target
    hidden_target: float = 0.0  # share of the target's points behind a surface of the source
    fitness_visible_source: float = 0.0  # share of the visible source points with a target point near by
    fitness_visible_target: float = 0.0  # share of the visible target points with a source point near by
    normals: float = 0.0  # mean cosine between the normals of points and their neighbours
    inlier_rmse: float = 0.0  # metres, of the agreeing points to the other cloud's planes
    closely: float = 0.0  # nats per point by which the points lie closer to the surfaces than by chance
    scale: float = 1.0  # what the source must be multiplied by to fit best; 1 where no other size fits better
    size_gain: float = 0.0  # nats per point gained at that size
    matches_agreeing: float = 0.0  # matches of the pipeline's matcher that agree with the pose

    @classmethod
    def at(
        cls,
        agreement: Agreement,
        held: Information,
        found_by: int = 1,
        matched: float = 0.0,
        closeness: float = 0.0,
    ) -> Evidence:
        """The first group, of one pose by itself."""
        least, middle, most = np.sort(agreement.shares)
        looked, agreed, through = agreement.rare
        return cls(
            agreement_least=float(least),
            agreement_middle=float(middle),
            agreement_most=float(most),
            looked_least=float(agreement.looked.min()),
            looked_through=agreement.looked_through,
            looked_through_source=share(agreement.source.free, agreement.source.looked),
            looked_through_target=share(agreement.target.free, agreement.target.looked),
            agreement_rare=agreed / (looked + PSEUDO_COUNT),
            looked_through_rare=through / (looked + PSEUDO_COUNT),
            agreed_rare=agreed,
            through_rare=through,
            relief_cells=float(agreement.relief.cells),
            relief_correlation=float(agreement.relief.correlation),
            weakest=held.weakest,
            found_by=float(found_by),
            matched=float(matched),
            closeness=float(closeness),
            overturned=float(agreement.overturned),
        )

    def as_dict(self) -> dict[str, float]:
        """The facts by name."""
        return asdict(self)


def share(part: Mask, whole: Mask) -> float:
    """Share of the points marked in `whole` (n,) that `part` (n,) marks too; 0 where none is marked."""
    n = int(np.count_nonzero(whole))
    return float(np.count_nonzero(part)) / n if n else 0.0
