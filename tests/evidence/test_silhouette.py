# SPDX-License-Identifier: MIT
"""A figure whose back is laid on its front is not "ok"; seen from one side it is, and a wall has no outline."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.sights import camera, look, pose
from hybridreg.evidence import views
from hybridreg.evidence.silhouette import seen_past
from hybridreg.pair import Pair

Array = NDArray[np.float64]


def figure() -> Place:
    """A body, a head and two legs, with a belly, a bag and folds, so that front and back differ."""
    place, rng = Place(), np.random.default_rng(3)
    place.post(0.0, 0.0, 0.2, 0.7, z=0.8, sides=48)
    place.post(0.0, 0.0, 0.11, 0.28, z=1.52, sides=48)
    for y in (-0.11, 0.11):
        place.post(0.0, y, 0.08, 0.8, sides=48)
        place.post(0.02, 2.7 * y, 0.06, 0.62, z=0.85, sides=48)
    place.box(0.16, 0.0, 0.95, (0.1, 0.14, 0.16))
    place.box(-0.16, 0.0, 1.1, (0.1, 0.24, 0.3))
    for angle, z, radius in zip(
        rng.uniform(0.0, 6.28, 24), rng.uniform(0.85, 1.4, 24), rng.uniform(0.03, 0.07, 24), strict=True
    ):
        place.post(0.18 * np.cos(angle), 0.18 * np.sin(angle), radius, 2.0 * radius, z=z, sides=24)
    return place


def seen(place: Place, around_deg: float, far: float, seed: int) -> Array:
    """By a depth camera that looks at the figure's middle."""
    rng, angle = np.random.default_rng(seed), np.radians(around_deg)
    at = pose(far * np.cos(angle), far * np.sin(angle), 1.2, around_deg + 180.0, 8.0, 0.0)
    return look(place.world(), camera((50.0, 60.0), 6.0, 0.004), at, rng).points


@pytest.mark.parametrize("apart_deg", [180.0, 172.0])
def test_its_back_laid_on_its_front_is_not_ok(apart_deg: float) -> None:
    result = hr.register(seen(figure(), apart_deg, 2.2, 1), seen(figure(), 0.0, 2.0, 2))
    assert result.verdict != "ok"
    assert "outlines do not coincide" in " ".join(result.reasons)


@pytest.mark.parametrize("apart_deg", [12.0, 25.0])
def test_from_one_side_its_outlines_coincide(apart_deg: float) -> None:
    result = hr.register(seen(figure(), apart_deg, 2.2, 1), seen(figure(), 0.0, 2.0, 2))
    assert result.verdict == "ok"


def test_what_ends_where_the_view_does_has_no_outline() -> None:
    wall = figure()
    wall.box(-0.8, 0.0, -1.0, (0.2, 8.0, 5.0))
    for place, alone in ((figure(), True), (wall, False)):
        pair = Pair.of(seen(place, 10.0, 2.2, 1), seen(place, 0.0, 2.0, 2))
        both = views.of(VoxelGrid(voxel=0.03)(pair))
        assert seen_past(both, looked_through=0.5) is alone
        assert not seen_past(both, looked_through=0.0)
