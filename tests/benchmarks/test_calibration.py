# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hybridreg.eval.run.row import Row
from hybridreg.eval.run.store import Appender
from hybridreg.geometry import se3
from hybridreg.verdict.training.calibration import draw, line, table, wilson

OFF = se3.yaw(10.0)


def folder(path: Path, *runs: tuple[str, float, np.ndarray]) -> Path:
    with Appender(path / "predictions" / "default.jsonl", {}) as file:
        for i, (name, confidence, T) in enumerate(runs):
            file.add(Row(index=i, id=name, confidence=confidence, T=T.tolist(), T_true=np.eye(4).tolist()))
        file.add(Row(index=len(runs), id="fell", error="no pose"))
    return path


def test_right_and_wrong_answers_are_counted_apart(tmp_path: Path) -> None:
    mid = folder(tmp_path / "default-mid", ("a", 0.99, np.eye(4)), ("b", 0.2, OFF), ("c", 0.97, OFF))
    text, p, right = table([mid])
    assert text.splitlines()[2].startswith("| mid | 3 | 1 | 1 | 1 |")
    assert p.tolist() == [0.99, 0.2, 0.97]
    assert right.tolist() == [True, False, False]


def test_on_disjoint_pairs_no_pose_is_right(tmp_path: Path) -> None:
    apart = folder(tmp_path / "default-disjoint", ("sim:test/disjoint/0/0", 0.1, np.eye(4)))
    assert not table([apart])[2].any()


def test_the_brier_score_is_that_of_its_definition() -> None:
    p, right = np.array([0.9, 0.2]), np.array([True, True])
    assert line("x", p, right).split("|")[-2].strip() == f"{(0.1**2 + 0.8**2) / 2:.3f}"


@pytest.mark.parametrize(("hits", "n"), [(0, 5), (5, 5), (48, 50)])
def test_an_interval_holds_its_share(hits: int, n: int) -> None:
    low, high = wilson(hits, n)
    assert 0.0 <= low <= hits / n <= high <= 1.0


def test_the_curve_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    rng = np.random.default_rng(0)
    p = rng.uniform(0.0, 1.0, 40)
    draw(p, rng.random(40) < p, tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 1_000
