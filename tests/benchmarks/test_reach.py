# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.reach import outcomes, table
from hybridreg.data import open_dataset
from hybridreg.eval.run.row import Row
from hybridreg.eval.run.store import Appender
from hybridreg.geometry import se3

DATA = "sim:train/mid#2"


def test_runs_are_told_apart_by_the_reach_of_their_clouds(tmp_path: Path) -> None:
    with Appender(tmp_path / "predictions" / "default.jsonl", {}) as file:
        for i, labelled in enumerate(open_dataset(DATA)):
            truth = labelled.T_target_source
            T = truth if i == 0 else se3.yaw(90.0) @ truth
            poses = {"T": T.tolist(), "T_true": truth.tolist()}
            file.add(Row(index=i, id=labelled.pair.id, confidence=0.97, verdict="ok", **poses))
        file.add(Row(index=2, id="of another data set", confidence=0.9))
    found = outcomes(tmp_path, DATA)
    assert [right for _, right, _ in found] == [True, False]
    assert all(ok and 0.5 < metres < 200.0 for metres, _, ok in found)


def test_each_class_counts_its_own_pairs() -> None:
    lines = table(
        [(3.0, False, True), (5.9, True, True), (6.0, True, False), (90.0, True, True)]
    ).splitlines()
    cells = np.array([[int(c) for c in line.split("|")[2:5]] for line in lines[2:]])
    assert cells.tolist() == [[2, 1, 1], [1, 1, 0], [0, 0, 0], [1, 1, 1]]
