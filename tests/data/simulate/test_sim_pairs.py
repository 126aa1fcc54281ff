# SPDX-License-Identifier: MIT
from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from joblib import Parallel, delayed

from hybridreg.data import simulate
from hybridreg.data.simulate import TIERS, Drawn, Sensor, draw
from hybridreg.data.simulate.sensing.overlaps import overlap, thin
from hybridreg.geometry import se3


def same(one: Drawn, other: Drawn) -> bool:
    return (
        one.source.tobytes() == other.source.tobytes()
        and one.target.tobytes() == other.target.tobytes()
        and one.jpeg == other.jpeg
        and one.T_target_source.tobytes() == other.T_target_source.tobytes()
        and one.overlap == other.overlap
    )


def test_drawn_alone_equals_drawn_in_a_run_and_in_other_processes(
    mid_pair: Drawn, thin_sensors: tuple[Sensor, Sensor]
) -> None:
    others = [draw("mid", k, *thin_sensors) for k in (10, 11)]
    assert same(others[1], mid_pair)
    assert not same(others[0], mid_pair)
    workers = Parallel(n_jobs=2)(delayed(draw)("mid", k, *thin_sensors) for k in (11, 10))
    assert same(workers[0], mid_pair)
    assert same(workers[1], others[0])


def test_workers_together_make_the_single_run(monkeypatch: pytest.MonkeyPatch, mid_pair: Drawn) -> None:
    drawn: list[int] = []
    monkeypatch.setattr(
        "hybridreg.data.simulate.labelled.draw", lambda tier, number, *_: drawn.append(number) or mid_pair
    )
    run = [p.pair.id for p in islice(simulate.pairs("mid", seed=2), 6)]
    parts = [[p.pair.id for p in islice(simulate.pairs("mid", seed=2, start=k, step=2), 3)] for k in (0, 1)]
    assert run == [pair_id for both in zip(*parts, strict=True) for pair_id in both]
    assert len(set(drawn[:6])) == 6


@pytest.mark.parametrize("tier", ["near", "mid", "far"])
def test_tiers_keep_their_distance_and_overlap(tier: str, thin_sensors: tuple[Sensor, Sensor]) -> None:
    rules = TIERS[tier]
    made = [draw(tier, k, *thin_sensors) for k in range(2)]
    level = [np.linalg.norm(d.T_target_source[:2, 3]) for d in made]
    assert all(rules.distance[0] - 1.0 < d < rules.distance[1] + 1.0 for d in level)
    # Four attempts each; the nearest miss may still stay outside.
    assert any(rules.overlap[0] <= d.overlap <= rules.overlap[1] for d in made)


def test_the_truth_aligns_the_clouds_and_its_inverse_does_not(mid_pair: Drawn) -> None:
    source, target = thin(mid_pair.source, 0.25), thin(mid_pair.target, 0.25)
    assert overlap(source, target, mid_pair.T_target_source) == pytest.approx(mid_pair.overlap)
    assert overlap(source, target, se3.inverse(mid_pair.T_target_source)) < 0.6 * mid_pair.overlap
    off = se3.from_rt(np.eye(3), np.array([0.0, 0.0, 1.0]))
    assert overlap(source, target, off @ mid_pair.T_target_source) < 0.6 * mid_pair.overlap


def test_frames_are_turned_freely_and_tilted_a_little(thin_sensors: tuple[Sensor, Sensor]) -> None:
    poses = [draw("mid", k, *thin_sensors).T_target_source for k in (20, 21, 22)]
    yaw = np.degrees([np.arctan2(T[1, 0], T[0, 0]) for T in poses])
    tilt = np.degrees([np.arccos(T[2, 2]) for T in poses])
    assert np.ptp(yaw) > 90
    assert (tilt > 0.1).any()
    assert (tilt < 12).all()


def test_disjoint_pairs_share_nothing_and_lie_far_apart(thin_sensors: tuple[Sensor, Sensor]) -> None:
    drawn = draw("disjoint", 3, *thin_sensors)
    assert drawn.overlap == 0.0
    assert 290 < np.linalg.norm(drawn.T_target_source[:3, 3]) < 610
    assert len(drawn.source) > 500
    assert len(drawn.target) > 500


def test_labelled_pair_hides_the_truth_from_the_pair(mid_pair: Drawn) -> None:
    labelled = simulate.to_labelled(mid_pair, "sim:train/mid/0/11")
    assert labelled.pair.source.points.shape == mid_pair.source.shape
    assert labelled.pair.image is not None
    assert labelled.pair.image.shape == (288, 512, 3)
    assert labelled.pair.source.sensor == "mems-fan"
    assert labelled.overlap == mid_pair.overlap
    assert not any("T_" in key or "overlap" in key for key in labelled.pair.meta)


def test_unknown_tier_names_the_tiers() -> None:
    with pytest.raises(ValueError, match="'medium'.*near, mid, far"):
        simulate.pair("medium")
