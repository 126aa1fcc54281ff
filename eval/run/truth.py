# SPDX-License-Identifier: MIT
"""Adds the ground truth to a method's result, after the method has returned."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybridreg.eval.run.attempt import Attempt
from hybridreg.eval.run.controls import near, true_overlap
from hybridreg.eval.run.row import Matrix, Row, matrix
from hybridreg.eval.score import metrics
from hybridreg.eval.score.protocols import INLIER_RADII
from hybridreg.frames import lower_pose, raise_matches
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.pair import LabelledPair, Pair
from hybridreg.pipeline import Trace
from hybridreg.resolution import default_voxel

# More source points than this change the measured overlap only in the third digit.
_SAMPLE = 10_000


def row(index: int, labelled: LabelledPair, tried: Attempt, match: Any = None) -> Row:
    """The row of a pair: the attempt, and the truth measured against it.

    ``match`` is the pipeline's match stage, which tells where it cuts the mask, and matches without its filters.
    """
    pair = labelled.pair
    cut, found = mask_threshold(match), _lowered(tried.T, pair)
    return Row(
        index=index,
        id=pair.id,
        T=found,
        T_estimated=_lowered(tried.T_estimated, pair),
        error=tried.error,
        seconds=tried.seconds,
        peak_memory_mb=tried.peak_memory_mb,
        n_points={"source": len(pair.source), "target": len(pair.target), **_level_sizes(tried.trace)},
        T_true=_lowered(labelled.T_target_source, pair),
        offsets=_offsets(pair),
        **_judged(tried),
        **_overlap(labelled, found),
        **_matched(tried.matches, _before_filters(tried.trace, match), labelled),
        mask=None if tried.trace is None else _mask(tried.trace, labelled, cut),
        mask_threshold=cut,
    )


def mask_threshold(match: Any) -> float:
    """The probability of overlap above which a match stage takes a point; 0.5 where it does not tell."""
    own = getattr(match, "mask_threshold", None)
    fixed = own() if callable(own) else getattr(match, "min_overlap", None)
    return 0.5 if fixed is None else float(fixed)


def _before_filters(trace: Trace | None, match: Any) -> Correspondences | None:
    # Run a second time, as the pose must come from what the stage gave; the encoding is there already.
    unfiltered = getattr(match, "unfiltered", None)
    stage = unfiltered() if trace is not None and callable(unfiltered) else None
    if trace is None or stage is None:
        return None
    return raise_matches(stage(trace.scene, trace.overlap), trace.scene.pair)


def _lowered(T: Any, pair: Pair) -> Matrix | None:
    # Half a degree about the origin of a map grid moves a cloud by kilometres: errors are only comparable
    # in the small coordinates.
    return None if matrix(T) is None else matrix(lower_pose(np.asarray(T, dtype=np.float64), pair))


def _offsets(pair: Pair) -> dict[str, list[float]] | None:
    if not (pair.source.offset.any() or pair.target.offset.any()):
        return None
    return {"source": pair.source.offset.tolist(), "target": pair.target.offset.tolist()}


def _judged(tried: Attempt) -> dict[str, Any]:
    result = tried.result
    if result is None:
        return {}
    own = {
        "fitness": result.fitness,
        "fitness_target": result.fitness_target,
        "inlier_rmse": result.inlier_rmse,
    }
    return {
        "verdict": result.verdict,
        "confidence": _finite(result.confidence),
        "reasons": list(result.reasons),
        "evidence": {key: _finite(value) for key, value in {**own, **result.evidence}.items()},
        "notes": list(result.notes),
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _level_sizes(trace: Trace | None) -> dict[str, int]:
    if trace is None:
        return {}
    return {"source_level": len(trace.scene.source), "target_level": len(trace.scene.target)}


def _overlap(labelled: LabelledPair, found: Matrix | None) -> dict[str, Any]:
    # The radius comes from the clouds alone, so that every method is measured on the same points.
    pair = labelled.pair
    radius = default_voxel(pair.source, pair.target)
    sample = pair.source.points[:: max(1, len(pair.source) // _SAMPLE)]
    true, own = se3.apply(lower_pose(labelled.T_target_source, pair), sample), _moved(found, sample)
    both = true if own is None else np.concatenate([true, own])
    hit = near(both, pair.target.points, radius).reshape(-1, len(sample))
    common = sample[hit[0]]
    return {
        "overlap_found": None if own is None else float(hit[1].mean()),
        "overlap": len(common) / len(sample),
        "overlap_radius": radius,
        "moments": matrix(metrics.second_moments(common)),
    }


def _moved(T: Matrix | None, points: metrics.Array) -> metrics.Array | None:
    # None where there is no pose, or one of absurd numbers.
    if T is None:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        moved = se3.apply(np.array(T), points)
    return moved if np.isfinite(moved).all() else None


def _matched(
    matches: Correspondences | None, unfiltered: Correspondences | None, labelled: LabelledPair
) -> dict[str, Any]:
    if matches is None:
        return {}
    kept = _right(matches, labelled.T_target_source)
    if unfiltered is None:
        return {"n_matches": len(matches), "inlier_ratio": kept}
    before = _right(unfiltered, labelled.T_target_source)
    return {"n_matches": len(matches), "inlier_ratio": before, "inlier_ratio_filtered": kept}


def _right(matches: Correspondences, truth: metrics.Array) -> dict[str, float]:
    residuals = metrics.match_residuals(matches.source, matches.target, truth)
    return {
        f"{radius:g}": float(np.mean(residuals < radius)) if len(residuals) else 0.0
        for radius in INLIER_RADII
    }


def _mask(trace: Trace, labelled: LabelledPair, threshold: float) -> dict[str, float] | None:
    # A mask that keeps every point is no prediction.
    predicted = np.concatenate([trace.overlap.source, trace.overlap.target])
    if np.all(predicted == 1.0):
        return None
    truth = true_overlap(trace.scene, lower_pose(labelled.T_target_source, labelled.pair))
    return metrics.mask_scores(predicted > threshold, np.concatenate(truth))._asdict()
