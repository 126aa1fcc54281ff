# SPDX-License-Identifier: MIT
"""The short cuts of a layout give what the plain forms give: drawn pairs hang on every last bit of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.simulate.world import chance
from hybridreg.data.simulate.world.scenes.scatter import in_box, spot
from hybridreg.data.simulate.world.taken import Taken
from hybridreg.data.simulate.world.uneven_ground import Terrain

SEEDS = st.integers(0, 2**32 - 1)


def touches(xy: np.ndarray, radius: float, at: np.ndarray, half: np.ndarray, yaw: float) -> bool:
    """Distance from a point to a turned rectangle, by turning the point into the rectangle's frame."""
    c, s = np.cos(yaw), np.sin(yaw)
    local = np.array([[c, s], [-s, c]]) @ (xy - at)
    return bool(np.linalg.norm(local - np.clip(local, -half, half)) <= radius)


@given(SEEDS)
def test_free_is_what_every_rectangle_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    taken, boxes = Taken(), []
    for _ in range(int(rng.integers(0, 300))):
        box = rng.uniform(-60, 60, 2), rng.uniform(0.1, 9, 2), float(rng.uniform(0, 6.3))
        taken.add(box[0], (box[1][0], box[1][1]), box[2])
        boxes.append(box)
    for xy, radius in zip(rng.uniform(-70, 70, (20, 2)), rng.uniform(0, 5, 20), strict=True):
        assert taken.free(xy, float(radius)) == (not any(touches(xy, radius, *box) for box in boxes))


def test_a_disc_beside_a_rectangle_and_one_upon_its_corner() -> None:
    taken = Taken()
    taken.add(np.array([10.0, 0.0]), (3.0, 1.0), np.pi / 2)  # turned: 1 m along x, 3 m along y
    assert taken.free(np.array([8.0, 0.0]), 0.99)
    assert not taken.free(np.array([8.0, 0.0]), 1.01)
    assert taken.free(np.array([8.0, 4.0]), 1.41)
    assert not taken.free(np.array([8.0, 4.0]), 1.42)


@pytest.mark.parametrize("shares", [None, (0.6, 0.2, 0.2), (0.52, 0.2, 0.18, 0.1), (1.0,)])
def test_draws_are_those_of_choice(shares: tuple[float, ...] | None) -> None:
    things = "abcd"[: len(shares)] if shares else "abcd"
    mine, theirs = np.random.default_rng(7), np.random.default_rng(7)
    drawn = [chance.one(mine, things, shares) for _ in range(500)]
    assert drawn == [str(theirs.choice(list(things), p=shares)) for _ in range(500)]
    assert mine.random() == theirs.random()
    assert set(drawn) == set(things)


@given(SEEDS)
def test_one_spot_is_a_box_of_one(seed: int) -> None:
    one, many = np.random.default_rng(seed), np.random.default_rng(seed)
    np.testing.assert_array_equal(spot(one, 28), in_box(many, (-28, -28), (28, 28), 1)[0])
    assert one.random() == many.random()


@given(SEEDS)
def test_height_at_one_place_is_that_of_many(seed: int) -> None:
    rng = np.random.default_rng(seed)
    terrain = Terrain.draw(rng, rng.uniform(0.1, 1.5))
    xy = rng.uniform(-120, 120, (5, 2))
    alone = [terrain.height_at(place) for place in xy]
    np.testing.assert_allclose(alone, terrain.height(xy[:, 0], xy[:, 1]), rtol=0, atol=1e-12)
