# SPDX-License-Identifier: MIT
"""Tiers of difficulty: how far apart the two sensors are and how much they overlap."""

from __future__ import annotations

from dataclasses import dataclass

from hybridreg.data.simulate.world.scenes import DEGENERATE, USUAL


@dataclass(frozen=True)
class Tier:
    """A kind of pair."""

    distance: tuple[float, float]  # metres between the sensors, level
    overlap: tuple[float, float]  # share of the thinned source with a target point within 0.5 m
    scenes: dict[str, float]  # scene kinds and their frequencies
    # Raised whenever this tier's pairs change; results are comparable only within one version.
    version: int = 2


TIERS = {
    "near": Tier((3.5, 6.5), (0.5, 0.95), USUAL),
    "mid": Tier((12.0, 18.0), (0.25, 0.8), USUAL),
    "far": Tier((25.0, 35.0), (0.12, 0.6), USUAL),
    "degenerate": Tier((3.0, 15.0), (0.15, 1.0), DEGENERATE, version=3),
    # Two entirely different places, and a transform that says so: hundreds of metres apart.
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
