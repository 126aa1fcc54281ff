# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data import yaw_starts
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair, Pair


def labelled(name: str = "x", offset: float = 0.0) -> LabelledPair:
    rng = np.random.default_rng(len(name))
    source = rng.uniform(-20.0, 20.0, (50, 3))
    T = se3.from_rt(se3.random_rotation(rng), rng.uniform(-5.0, 5.0, 3))
    there = np.array([offset, 2 * offset, 0.0])
    truth = T.copy()
    truth[:3, 3] += there - T[:3, :3] @ there
    pair = Pair.of(source + there, se3.apply(T, source) + there, id=name, meta={"kind": "made"})
    return LabelledPair(pair=pair, T_target_source=truth)


@given(st.integers(0, 5), st.integers(0, 1000), st.sampled_from([0.0, 5e6]))
def test_the_truth_turns_back(n: int, seed: int, offset: float) -> None:
    pairs = yaw_starts([labelled(offset=offset)], n, seed)
    assert len(pairs) == n + 1
    for each in pairs:
        moved = se3.apply(each.T_target_source, each.pair.source.points + each.pair.source.offset)
        assert np.allclose(
            moved, each.pair.target.points + each.pair.target.offset, atol=1e-5 if offset else 1e-9
        )


def test_names_and_what_stays() -> None:
    pairs = yaw_starts([labelled("a"), labelled("bb")], 2)
    assert pairs.ids == ("a", "a@yaw1", "a@yaw2", "bb", "bb@yaw1", "bb@yaw2")
    assert tuple(each.pair.id for each in pairs) == pairs.ids
    plain, turned = pairs[0], pairs[1]
    assert np.array_equal(plain.T_target_source, labelled("a").T_target_source)
    assert np.array_equal(plain.pair.target.points, turned.pair.target.points)
    assert turned.pair.meta == {"kind": "made"}
    # About the sensor, so that heights and ranges stay.
    assert np.allclose(
        np.linalg.norm(turned.pair.source.points, axis=1), np.linalg.norm(plain.pair.source.points, axis=1)
    )
    assert np.array_equal(turned.pair.source.points[:, 2], plain.pair.source.points[:, 2])
    assert not turned.pair.source.points.flags.writeable


def test_angles_hang_on_seed_name_and_number_alone() -> None:
    one, two = labelled("a"), labelled("bb")
    assert np.array_equal(
        yaw_starts([one, two], 3, seed=4)[5].T_target_source, yaw_starts([two], 1, seed=4)[1].T_target_source
    )
    truths = [yaw_starts([one], 2, seed)[i].T_target_source for seed in (0, 1) for i in (1, 2)]
    assert len({T.tobytes() for T in truths}) == 4


def test_angles_cover_the_circle() -> None:
    pairs = yaw_starts([labelled("a")], 300)
    back = [se3.inverse(pairs[0].T_target_source) @ each.T_target_source for each in pairs[1:]]
    angles = np.degrees([np.arctan2(T[1, 0], T[0, 0]) for T in back])
    assert np.all(np.histogram(angles, bins=6, range=(-180, 180))[0] > 25)


def test_fingerprint_tells_the_starts() -> None:
    base = [labelled()]
    assert len({yaw_starts(base, n, seed).fingerprint() for n, seed in ((1, 0), (2, 0), (1, 1))}) == 3


def test_a_negative_count_and_a_double_name_are_refused() -> None:
    with pytest.raises(ValueError, match="starts=-1"):
        yaw_starts([labelled()], -1)
    with pytest.raises(ValueError, match="2 pairs called 'x'"):
        yaw_starts([labelled(), labelled()], 1)
