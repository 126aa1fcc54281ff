# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from eval_stubs import row
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.eval import PROTOCOLS, Protocol, protocol, score
from hybridreg.eval.score import bootstrap, curves, errors, scoring
from hybridreg.eval.scored_table import Entry, Table

CROSS, KITTI, PREDATOR = (PROTOCOLS[name] for name in ("cross3dreg", "kitti", "predator"))


def test_thresholds_are_the_published_ones() -> None:
    told = {p.name: (p.rre_deg, p.rte_m, p.average) for p in PROTOCOLS.values()}
    assert told["cross3dreg"] == (2.0, 0.5, "all")
    assert told["kitti"] == (5.0, 2.0, "success")
    assert told["predator"] == (5.0, 2.0, "criterion")
    assert told["kitti-strict"][:2] == (5.0, 0.6)
    assert told["3dcsr"][:2] == (15.0, 0.3)
    assert CROSS.inlier_m == 1.0
    assert PROTOCOLS["3dmatch-rmse"].rmse_m == 0.2


def test_unknown_protocol_lists_the_known() -> None:
    with pytest.raises(KeyError, match=r"'kiti'.*cross3dreg, kitti"):
        protocol("kiti")


def test_three_averages_of_the_same_rows_differ_as_they_should() -> None:
    # Right; rotation right and translation wrong; the reverse; all wrong.
    rows = [row(0, 1.0, 0.4), row(1, 3.0, 8.0), row(2, 90.0, 1.0), row(3, 120.0, 20.0)]
    s = score(rows, KITTI)
    assert (s.n, s.n_failed, s.recall) == (4, 0, 0.25)
    assert (s.rre_deg_all, s.rte_m_all) == pytest.approx((53.5, 7.35))
    assert (s.rre_deg_ok, s.rte_m_ok) == pytest.approx((1.0, 0.4))
    assert (s.rre_deg_criterion, s.rte_m_criterion) == pytest.approx((2.0, 0.7))
    assert (s.rre_deg_median, s.rte_m_median) == pytest.approx((46.5, 4.5))


@pytest.mark.parametrize("field", ["recall", "recall_at"])
def test_a_row_without_a_pose_is_no_success_even_where_the_identity_would_be(field: str) -> None:
    near = dataclasses.replace(row(0, 0.0, 0.0), T_true=np.eye(4).tolist(), T=None, error="RuntimeError: no")
    s = score([near], CROSS)
    assert s.n_failed == 1
    assert s.recall == 0.0
    assert set(s.recall_at.values()) == {0.0}
    # It is measured as the identity, which here is exact.
    assert (s.rre_deg_all, s.rte_m_all) == (0.0, 0.0)
    assert np.isnan(s.rre_deg_ok)
    assert np.isnan(s.rre_deg_criterion)


def test_a_failed_row_is_measured_with_the_identity() -> None:
    failed = dataclasses.replace(row(0, 0.0, 0.0), T=None)
    same = dataclasses.replace(failed, T=np.eye(4).tolist())
    assert score([failed], KITTI).rte_m_all == score([same], KITTI).rte_m_all == pytest.approx(np.sqrt(14.0))


def test_a_pair_that_could_not_be_read_counts_against_recall_only() -> None:
    lost = dataclasses.replace(row(1, 0.0, 0.0), T=None, T_true=None, error="OSError: gone")
    s = score([row(0, 1.0, 0.1), lost], KITTI)
    assert (s.recall, s.n_failed) == (0.5, 1)
    assert s.rre_deg_all == pytest.approx(1.0)
    entries = [Entry(name="m", rows=[row(0, 1.0, 0.1), lost])]
    (told,) = Table(title="t", data="d", seed=0, starts=0, entries=entries).remarks()
    assert told == (
        "1 of 2 pairs could not be read: against the recall, in no other number; the first, "
        f"{lost.id}: OSError: gone"
    )


def test_success_is_strict() -> None:
    exact = Protocol(name="x", rre_deg=2.0, rte_m=0.5, inlier_m=1.0, average="all", source="")
    measured = errors.Errors(
        np.array([2.0, 1.0, 1.0]), np.array([0.1, 0.5, 0.1]), np.zeros(3), np.zeros(3, bool)
    )
    assert measured.success(exact).tolist() == [False, False, True]


def test_rmse_protocol_looks_at_points_not_at_angles() -> None:
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (500, 3))
    moments = (np.c_[points, np.ones(500)].T @ np.c_[points, np.ones(500)] / 500).tolist()
    # 6 degrees on points within a metre is a small motion: right by RMSE, wrong by KITTI's angle.
    turned = row(0, 6.0, 0.0, moments=moments, overlap=0.5)
    far = row(1, 0.0, 0.25, moments=moments, overlap=0.5)
    assert score([turned], PROTOCOLS["3dmatch-rmse"]).recall == 1.0
    assert score([turned], KITTI).recall == 0.0
    assert score([far], PROTOCOLS["3dmatch-rmse"]).recall == 0.0


def test_refinement_is_scored_beside_the_estimate() -> None:
    good, bad = row(0, 0.5, 0.1), row(0, 10.0, 0.1)
    refined = dataclasses.replace(good, T_estimated=bad.T)
    assert (score([refined], KITTI).recall, score([refined], KITTI).recall_estimated) == (1.0, 0.0)
    assert np.isnan(score([good], KITTI).recall_estimated)


def test_inlier_ratio_at_the_protocols_radius() -> None:
    ratio = {"0.1": 0.01, "0.5": 0.04, "1": 0.9}
    rows = [row(0, 1, 1, inlier_ratio=ratio, n_matches=10), row(1, 1, 1, inlier_ratio=ratio, n_matches=5)]
    assert score(rows, CROSS).inlier_ratio == pytest.approx(0.9)
    assert score(rows, CROSS).fmr == 1.0
    assert score(rows, PROTOCOLS["fine"]).fmr == 0.0
    odd = dataclasses.replace(CROSS, inlier_m=0.7)
    with pytest.raises(
        ValueError, match=r"at 0\.1, 0\.5, 1 m, not at 0\.7 m; give inlier_m one of 0\.05, .*, 2"
    ):
        score(rows, odd)
    with pytest.raises(ValueError, match=r"not at 0\.6 m; predict again"):
        score(rows, dataclasses.replace(CROSS, inlier_m=0.6))


def test_a_method_that_has_no_matches_at_one_pair_is_charged_for_it_once() -> None:
    ratio = {"1": 0.8}
    rows = [
        row(0, 1, 1, inlier_ratio=ratio, n_matches=10),
        row(1, 1, 1, inlier_ratio={"1": 0.0}, n_matches=0),
        row(2, 1, 1, error="RuntimeError: no"),
    ]
    # The ratio of no matches is zero, and belongs into the mean.
    assert score(rows, CROSS).inlier_ratio == pytest.approx(0.8 / 3)


def test_a_method_without_matches_has_no_inlier_ratio() -> None:
    assert np.isnan(
        score([row(0, 1, 1, inlier_ratio={"1": 0.0}, n_matches=0), row(1, 1, 1)], CROSS).inlier_ratio
    )


def test_no_rows_are_refused() -> None:
    with pytest.raises(ValueError, match="no rows"):
        score([], KITTI)


@given(st.lists(st.tuples(st.floats(0, 20), st.floats(0, 6)), min_size=1, max_size=12))
def test_curves_rise_and_meet_the_recall(pairs: list[tuple[float, float]]) -> None:
    rows = [row(i, rre, rte) for i, (rre, rte) in enumerate(pairs)]
    measured = errors.of(rows)
    recall = measured.success(KITTI).mean()
    for curve, own in (
        (curves.sweep(measured, KITTI, "rre"), KITTI.rre_deg),
        (curves.sweep(measured, KITTI, "rte"), KITTI.rte_m),
    ):
        assert np.all(np.diff(curve.recall) >= 0)
        assert curve.recall[np.isclose(curve.threshold, own)].tolist() == [pytest.approx(recall)]


def test_interval_holds_the_mean_and_is_repeatable() -> None:
    values = np.array([1.0, 0, 1, 1, 0, 1, 0, 1, 1, 1])
    names = [f"pair-{i}" for i in range(10)]
    low, high = bootstrap.interval(values, names)
    assert 0.3 <= low < 0.7 < high <= 1.0
    assert bootstrap.interval(values, names) == (low, high)


def test_turned_copies_do_not_narrow_the_interval() -> None:
    values = np.array([1.0, 0, 1, 1, 0, 1])
    names = [f"pair-{i}" for i in range(6)]
    copied = np.repeat(values, 4)
    by_scene = bootstrap.interval(copied, np.repeat(names, 4).tolist())
    as_if_independent = bootstrap.interval(copied, [str(i) for i in range(24)])
    assert by_scene == bootstrap.interval(values, names)
    assert by_scene[1] - by_scene[0] > 1.5 * (as_if_independent[1] - as_if_independent[0])


def test_only_a_turned_copy_belongs_to_the_scene_of_another_pair() -> None:
    names = ["drive@0", "drive@1", "drive@1@yaw2", "a@b@yaw", "plain@yaw13"]
    rows = [dataclasses.replace(row(0, 0.0, 0.0), id=name) for name in names]
    assert [scoring.scene_of(each) for each in rows] == ["drive@0", "drive@1", "drive@1", "a@b@yaw", "plain"]


def test_interval_of_nothing_is_nan() -> None:
    assert np.isnan(bootstrap.interval(np.array([np.nan]), ["a"])).all()


def test_coverage_of_the_interval() -> None:
    # 95 % nominal on 40 Bernoulli(0.7) draws; the percentile bootstrap is known to fall a little short.
    rng = np.random.default_rng(0)
    names = [str(i) for i in range(40)]
    inside = 0
    for _ in range(150):
        low, high = bootstrap.interval((rng.uniform(size=40) < 0.7).astype(float), names)
        inside += low <= 0.7 <= high
    assert 0.88 <= inside / 150 <= 0.99


def test_the_identity_row_has_the_truths_own_size() -> None:
    rows = [row(0, 1.0, 1.0), row(1, 1.0, 1.0)]
    same = scoring.identity(rows)
    assert [r.id for r in same] == ["pair-0", "pair-1"]
    assert score(same, KITTI).rte_m_all == pytest.approx(np.sqrt(14.0))
