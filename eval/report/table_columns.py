# SPDX-License-Identifier: MIT
"""The columns of a results table, the same in every format."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from hybridreg.config.number_of import number_of
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.score.scoring import Score
from hybridreg.slots import in_order

Cells = dict[str, str]

# Shares of the source that the target's sensor saw too.
_OVERLAPS = ((0.0, 0.3), (0.3, 0.6), (0.6, 1.01))


def results(name: str, score: Score) -> Cells:
    """A method's line in the main table."""
    cells = {
        "method": name,
        "recall %": percent(score.recall),
        "95 % interval": f"{percent(score.recall_low)} to {percent(score.recall_high)}",
        "RRE° all": number(score.rre_deg_all, 2),
        "RTE m all": number(score.rte_m_all, 2),
        "RRE° successes": number(score.rre_deg_ok, 2),
        "RTE m successes": number(score.rte_m_ok, 2),
        "RRE° median": number(score.rre_deg_median, 2),
        "RTE m median": number(score.rte_m_median, 2),
    }
    if score.protocol.average == "criterion":
        cells["RRE° criterion"] = number(score.rre_deg_criterion, 2)
        cells["RTE m criterion"] = number(score.rte_m_criterion, 2)
    return {
        **cells,
        "inliers %": percent(score.inlier_ratio),
        "inliers % filtered": percent(score.inlier_ratio_filtered),
        "FMR %": percent(score.fmr),
        "recall % unrefined": percent(score.recall_estimated),
        "no pose": f"{score.n_failed} of {score.n}",
        "s a pair": number(score.seconds.get("total", math.nan), 2),
        "peak MB": number(score.peak_memory_mb, 0),
    }


def printed(name: str, score: Score) -> Cells:
    """A method's line as papers print it: errors in the protocol's own averaging, recall with its interval, inliers."""
    recall = percent(score.recall)
    interval = f" [{percent(score.recall_low)}, {percent(score.recall_high)}]"
    return {
        "Method": name,
        "RRE (°)": number(score.rre_deg, 2),
        "RTE (m)": number(score.rte_m, 2),
        "RR (%)": recall + interval,
        "IR (%)": percent(score.inlier_ratio),
    }


def thresholds(name: str, score: Score) -> Cells:
    """Recall at the fixed thresholds."""
    return {"method": name, **{f"recall % {at}": percent(r) for at, r in score.recall_at.items()}}


def stages(scores: Mapping[str, Score]) -> list[Cells]:
    """Mean seconds of each stage, one line a method."""
    ran = dict.fromkeys(stage for score in scores.values() for stage in score.seconds)
    names = sorted(ran, key=in_order)
    return [
        {"method": name, **{f"{s} s": number(score.seconds.get(s, math.nan), 3) for s in names}}
        for name, score in scores.items()
        if score.seconds
    ]


def verdicts(name: str, rows: Sequence[Row], protocol: Protocol) -> Cells:
    """How often each verdict was right: successes among the pairs with it."""
    success = errors.of(rows).success(protocol)
    cells = {"method": name}
    for word in ("ok", "doubtful", "failed"):
        hits = [bool(s) for s, row in zip(success, rows, strict=True) if row.verdict == word]
        cells[f'"{word}"'] = f"{sum(hits)} right of {len(hits)}"
    return cells


def by_overlap(name: str, rows: Sequence[Row], protocol: Protocol) -> Cells:
    """Recall among pairs of low, medium and high overlap."""
    success = errors.of(rows).success(protocol)
    cells = {"method": name}
    for low, high in _OVERLAPS:
        hits = [
            bool(s)
            for s, row in zip(success, rows, strict=True)
            if row.overlap is not None and low <= row.overlap < high
        ]
        share = percent(sum(hits) / len(hits)) if hits else "–"
        cells[f"overlap {low:g} to {min(high, 1.0):g}"] = f"{share} ({number_of(len(hits), 'pair')})"
    return cells


def masks(name: str, rows: Sequence[Row]) -> Cells:
    """Means of the overlap mask's measures over the pairs that have one."""
    found = [row.mask for row in rows if row.mask]
    cells = {"method": name, "pairs": str(len(found))}
    for key, title in (("precision", "precision"), ("recall", "recall"), ("f1", "F1"), ("iou", "IoU")):
        cells[f"{title} %"] = percent(sum(mask[key] for mask in found) / len(found))
    return cells


def percent(value: float) -> str:
    """A share as percent with one digit."""
    return number(100.0 * value, 1)


def number(value: float, digits: int) -> str:
    """A number, or a dash where there is none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"
