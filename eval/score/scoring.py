# SPDX-License-Identifier: MIT
"""Stored rows under a protocol: recall, errors under every averaging, intervals, seconds, memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.yaw_starts import start_of
from hybridreg.eval.run.row import Row
from hybridreg.eval.run.store import Predictions
from hybridreg.eval.score import bootstrap, errors
from hybridreg.eval.score.errors import Errors, Step
from hybridreg.eval.score.protocols import INLIER_RADII, RECALL_AT, Protocol
from hybridreg.eval.score.protocols import protocol as protocol_named

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

# A pair counts as matched at this inlier ratio (FMR).
_MATCHED = 0.05


@dataclass(frozen=True, kw_only=True)
class Score:
    """One method under one protocol.

    Attributes
    ----------
    n, n_failed : pairs, and those without a pose; these count as the identity and as no success
    recall, recall_low, recall_high : share of successes, and its bootstrap 95 % interval over pairs
    rre_deg_all, rte_m_all : means over all pairs
    rre_deg_ok, rte_m_ok : means over successes
    rre_deg_criterion, rte_m_criterion : each over the pairs that meet that error's own threshold
    rre_deg_median, rte_m_median : over all pairs
    inlier_ratio, fmr : mean share of right matches before any filter, and share of pairs with at least 5 % of them;
        NaN for a method that makes no matches
    inlier_ratio_filtered : mean share of right matches among those that the pose was estimated from
    recall_estimated : recall of the poses before refinement; NaN where a method does not tell them
    recall_at : recall at fixed thresholds, by their text
    mask_f1 : mean F1 of the overlap masks; NaN without them
    seconds : mean seconds a pair, by stage
    peak_memory_mb : the highest of all pairs
    """

    protocol: Protocol
    n: int
    n_failed: int
    recall: float
    recall_low: float
    recall_high: float
    rre_deg_all: float
    rte_m_all: float
    rre_deg_ok: float
    rte_m_ok: float
    rre_deg_criterion: float
    rte_m_criterion: float
    rre_deg_median: float
    rte_m_median: float
    inlier_ratio: float
    inlier_ratio_filtered: float
    fmr: float
    recall_estimated: float
    recall_at: dict[str, float]
    mask_f1: float
    seconds: dict[str, float]
    peak_memory_mb: float

    @property
    def rre_deg(self) -> float:
        """The rotation error in the protocol's own averaging."""
        return {"all": self.rre_deg_all, "success": self.rre_deg_ok, "criterion": self.rre_deg_criterion}[
            self.protocol.average
        ]

    @property
    def rte_m(self) -> float:
        """The translation error in the protocol's own averaging."""
        return {"all": self.rte_m_all, "success": self.rte_m_ok, "criterion": self.rte_m_criterion}[
            self.protocol.average
        ]


def score(rows: Sequence[Row] | Predictions, protocol: Protocol | str) -> Score:
    """Score rows, as `predict` returns them, or what `read` returns, under a protocol or the one of a name.

    Raises
    ------
    TypeError
        Neither of these, or no protocol.
    KeyError
        No protocol has that name.
    ValueError
        No rows, or rows that do not hold what the protocol needs.
    """
    protocol = protocol_named(protocol) if isinstance(protocol, str) else protocol
    rows = list(rows.rows if isinstance(rows, Predictions) else rows)
    wrong = next((row for row in rows if not isinstance(row, Row)), None)
    if wrong is not None:
        raise TypeError(
            f"rows: expected what predict or read returned, got {type(wrong).__name__} among them"
        )
    if not isinstance(protocol, Protocol):
        raise TypeError(f"protocol {protocol!r}: expected one such as hybridreg.eval.protocol('kitti')")
    if not rows:
        raise ValueError("there are no rows to score")
    measured = errors.of(rows)
    success = measured.success(protocol)
    low, high = bootstrap.interval(success.astype(np.float64), [scene_of(row) for row in rows])
    ratios = inlier_ratios(rows, protocol)
    masks = [row.mask["f1"] for row in rows if row.mask]
    return Score(
        protocol=protocol,
        n=len(rows),
        n_failed=int(measured.failed.sum()),
        recall=float(success.mean()),
        recall_low=low,
        recall_high=high,
        **_averages(measured, success, protocol),
        inlier_ratio=_mean(ratios),
        inlier_ratio_filtered=_mean(inlier_ratios(rows, protocol, filtered=True)),
        fmr=_mean((ratios >= _MATCHED).astype(np.float64)),
        recall_estimated=_recall(rows, protocol, "estimated"),
        recall_at={f"{r:g}°, {t:g} m": float(measured.within(r, t).mean()) for r, t in RECALL_AT},
        mask_f1=_mean(np.array(masks)),
        seconds=mean_seconds(rows),
        peak_memory_mb=max((row.peak_memory_mb for row in rows if row.peak_memory_mb), default=float("nan")),
    )


def scene_of(row: Row) -> str:
    """Name of the pair that a row's random yaw rotations come from."""
    return start_of(row.id)


def identity(rows: Sequence[Row]) -> list[Row]:
    """Rows of the identity pose on the same pairs: what a failure on nearby pairs looks like."""
    eye = np.eye(4).tolist()
    return [
        Row(index=r.index, id=r.id, T=eye if r.T_true else None, T_true=r.T_true, overlap=r.overlap,
            overlap_radius=r.overlap_radius, moments=r.moments, n_points=r.n_points)
        for r in rows
    ]  # fmt: skip


def inlier_ratios(rows: Sequence[Row], protocol: Protocol, *, filtered: bool = False) -> Array:
    """Share of right matches of each row at the protocol's radius; empty for a method that makes no matches.

    Of all that the features gave, or ``filtered``, of those that the matcher let through.

    A pair at which a method that matches has found none counts as 0.
    """
    key = f"{protocol.inlier_m:g}"
    if not any(row.n_matches for row in rows):
        return np.zeros(0)
    told = [(filtered and row.inlier_ratio_filtered) or row.inlier_ratio for row in rows]
    stored = [ratio for ratio in told if ratio]
    lacking = next((ratio for ratio in stored if key not in ratio), None)
    if lacking is not None:
        known = [f"{radius:g}" for radius in INLIER_RADII]
        cure = "predict again" if key in known else f"give inlier_m one of {', '.join(known)}"
        raise ValueError(f"inlier ratios are stored at {', '.join(lacking)} m, not at {key} m; {cure}")
    ratios = [
        (ratio or {}).get(key, 0.0) for ratio, row in zip(told, rows, strict=True) if row.T_true is not None
    ]
    return np.array(ratios)


def mean_seconds(rows: Sequence[Row]) -> dict[str, float]:
    """Mean seconds of each stage over the rows that ran it, and in total."""
    stages = dict.fromkeys(stage for row in rows for stage in row.seconds)
    return {stage: float(np.mean([r.seconds[stage] for r in rows if stage in r.seconds])) for stage in stages}


def _averages(measured: Errors, success: Bools, protocol: Protocol) -> dict[str, float]:
    found = ~measured.failed
    return {
        "rre_deg_all": _mean(measured.rre_deg),
        "rte_m_all": _mean(measured.rte_m),
        "rre_deg_ok": _mean(measured.rre_deg[success]),
        "rte_m_ok": _mean(measured.rte_m[success]),
        "rre_deg_criterion": _mean(measured.rre_deg[found & (measured.rre_deg < protocol.rre_deg)]),
        "rte_m_criterion": _mean(measured.rte_m[found & (measured.rte_m < protocol.rte_m)]),
        "rre_deg_median": _median(measured.rre_deg),
        "rte_m_median": _median(measured.rte_m),
    }


def _recall(rows: Sequence[Row], protocol: Protocol, step: Step) -> float:
    if not any(row.T_estimated for row in rows):
        return float("nan")
    return float(errors.of(rows, step).success(protocol).mean())


def _mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else float("nan")


def _median(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if len(finite) else float("nan")
