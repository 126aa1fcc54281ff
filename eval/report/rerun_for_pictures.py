# SPDX-License-Identifier: MIT
"""Pictures of a table's pairs: its pipelines are run again on a few of them, with the same seed."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.config.plain_values import value_of
from hybridreg.data.dataset import ids_of
from hybridreg.eval.report import stage_pictures
from hybridreg.eval.run.controls import Control, after
from hybridreg.eval.run.truth import mask_threshold
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry, Table
from hybridreg.eval.table_file import slug
from hybridreg.frames import lower_pose
from hybridreg.pair import LabelledPair
from hybridreg.pipeline import Pipeline, Trace
from hybridreg.slots import SLOTS


def redraw(
    table: Table,
    protocol: Protocol,
    pairs: Sequence[LabelledPair],
    out: str | os.PathLike[str],
    n: int,
) -> list[Path]:
    """Write pictures of the first ``n`` pairs under every pipeline of a table.

    Returns
    -------
    Files ``out/<line>/<pair>-matches.png`` of pipelines with matches, and ``-mask.png`` of those whose overlap stage
    leaves points out.

    Raises
    ------
    MissingWeights, ValueError
        A pipeline cannot be built again.
    """
    written = []
    ids = ids_of(pairs)
    for entry in table.methods:
        control = control_of(entry)
        if control is None:
            continue
        folder = Path(out) / slug(entry.name)
        for name in [row.id for row in entry.rows if row.error is None and row.id in ids][:n]:
            written += _draw(rerun(entry.name, control, pairs, ids.index(name), table.seed), protocol, folder)
    return written


def control_of(entry: Entry) -> Control | None:
    """The pipeline that made a line, as a control; None for a plain function, which left no word of how to make it
    again.

    Raises
    ------
    MissingWeights, ValueError
        It cannot be built again.
    """
    spec: Mapping[str, Any] = entry.config.get("method", {})
    if not set(SLOTS) <= set(spec):
        return None
    pipeline = Pipeline(**{part: spec[part] for part in (*SLOTS, "prior") if part in spec})
    told = value_of(Mapping[str, Any], spec.get("control", {}), f"{entry.name}: control")
    unknown = set(told) - {"oracle", "image"}
    if unknown:
        raise ValueError(f"{entry.name}: no control is called {', '.join(sorted(unknown))}")
    return Control(pipeline=pipeline, **told)


class Rerun(NamedTuple):
    """A method on a pair once more: its trace, the true pose (4, 4), and where its matcher cuts the mask."""

    method: str
    pair: str
    trace: Trace
    truth: NDArray[np.float64]
    threshold: float


def rerun(method: str, control: Control, pairs: Sequence[LabelledPair], index: int, seed: int) -> Rerun:
    """Run a method on a pair once more."""
    labelled = pairs[index]
    pipeline, pair = control.told(labelled, after(pairs, index))
    truth = lower_pose(labelled.T_target_source, pair)
    return Rerun(method, pair.id, pipeline.trace(pair, seed=seed), truth, mask_threshold(pipeline.match))


def _draw(one: Rerun, protocol: Protocol, folder: Path) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    if len(one.trace.matches):
        written.append(folder / f"{slug(one.pair)}-matches.png")
        stage_pictures.matches(written[-1], one.trace, one.truth, protocol.inlier_m)
    if not keeps_all(one.trace):
        written.append(folder / f"{slug(one.pair)}-mask.png")
        stage_pictures.mask(written[-1], one.trace, one.truth, one.threshold)
    return written


def keeps_all(trace: Trace) -> bool:
    """Does the overlap stage leave nothing out?"""
    return bool(np.all(trace.overlap.source == 1.0) and np.all(trace.overlap.target == 1.0))
