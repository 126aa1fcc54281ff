# SPDX-License-Identifier: MIT
"""How far apart the two sensors stand and how much they share."""

from __future__ import annotations

from dataclasses import dataclass

from hybridreg.data.simulate.world.scenes import DEGENERATE, USUAL


@dataclass(frozen=True)
class Tier:
    """A kind of pair."""

    distance: tuple[float, float]  # metres between the sensors, level
    overlap: tuple[float, float]  # share of the thinned source with a target point within 0.5 m
    scenes: dict[str, float]  # scene kinds and how often each comes
    # Raised whenever the simulator draws this tier's pairs anew; results are comparable within one version only.
    version: int = 2


TIERS = {
    "near": Tier((3.5, 6.5), (0.5, 0.95), USUAL),
    "mid": Tier((12.0, 18.0), (0.25, 0.8), USUAL),
    "far": Tier((25.0, 35.0), (0.12, 0.6), USUAL),
    "degenerate": Tier((3.0, 15.0), (0.15, 1.0), DEGENERATE, version=3),
    # Two different places altogether, and a transform that says so: hundreds of metres apart.
    "disjoint": Tier((300.0, 600.0), (0.0, 0.0), USUAL),
}


def tier_named(name: str) -> Tier:
    """The tier of that name.

    Raises
    ------
    ValueError
        For a name that is not a tier's; the message lists them.
    """
    if name not in TIERS:
        raise ValueError(f"there is no tier {name!r}; the tiers are {', '.join(TIERS)}")
    return TIERS[name]
