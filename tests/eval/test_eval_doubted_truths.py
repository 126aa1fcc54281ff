# SPDX-License-Identifier: MIT
"""Truths that the clouds contradict are told, with the likely mistake; right ones never."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from eval_stubs import Scattered
from numpy.typing import NDArray

from hybridreg.eval import predict
from hybridreg.eval.run.row import Row
from hybridreg.eval.score.doubted_truths import remarks
from hybridreg.eval.scored_table import Entry, Table
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]
TRUTHS = [
    se3.from_rt(se3.random_rotation(rng), rng.uniform(5.0, 9.0, 3))
    for rng in map(np.random.default_rng, range(4))
]


def rows(mistake: Callable[[int], Array], overlap: float = 0.05) -> list[Row]:
    return [
        Row(
            index=i,
            id=f"p{i}",
            T=T.tolist(),
            T_true=mistake(i).tolist(),
            verdict="ok",
            overlap=overlap,
            overlap_found=0.8,
            overlap_radius=0.5,
        )
        for i, T in enumerate(TRUTHS)
    ]


def stretched(i: int, times: float) -> Array:
    return se3.from_rt(TRUTHS[i][:3, :3], times * TRUTHS[i][:3, 3])


def mirrored(i: int) -> Array:
    S = np.diag([1.0, -1.0, 1.0, 1.0])
    return np.asarray(S @ TRUTHS[i] @ S)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda i: se3.inverse(TRUTHS[i]), "inverted"),
        (lambda i: stretched(i, 1000.0), "millimetres"),
        (lambda i: stretched(i, 100.0), "centimetres"),
        (lambda i: stretched(i, 0.001), "kilometres"),
        (lambda i: stretched(i, 1.0 / 0.3048), "feet"),
        (mirrored, "y mirrored"),
        (lambda i: TRUTHS[(i + 1) % 4], "the pair before"),
        (lambda i: TRUTHS[i - 1], "the pair after"),
        (lambda i: np.eye(4), "without a translation"),
        (lambda i: se3.from_rt(se3.yaw(1.0)[:3, :3], np.full(3, 40.0)), "Look at one of them"),
    ],
)
def test_the_mistake_is_named(mistake: Callable[[int], Array], words: str) -> None:
    (told,) = remarks(rows(mistake))
    assert words in told
    assert (
        "80% of the source lie on the target, under the true one 5%, in 4 of 4 pairs: p0, p1, p2, p3." in told
    )


def test_what_no_pose_called_ok_contradicts_is_not_told() -> None:
    wrong = rows(lambda i: se3.inverse(TRUTHS[i]))
    assert not remarks(rows(lambda i: TRUTHS[i], overlap=0.8))
    assert not remarks([replace(row, verdict="doubtful") for row in wrong])
    assert not remarks([replace(row, overlap=0.5) for row in wrong])
    assert not remarks([replace(row, overlap_found=None) for row in wrong])


def test_a_table_tells_it() -> None:
    entries = [Entry(name="m", rows=rows(lambda i: stretched(i, 1000.0)))]
    table = Table(title="t", data="d", seed=0, starts=0, entries=entries)
    assert any("millimetres" in remark for remark in table.remarks())


@dataclass(frozen=True)
class Off:
    """The true pose with its translation moved by so many metres, or no pose."""

    metres: float | None

    def __call__(self, pair: Any, seed: int) -> Array | None:
        labelled: LabelledPair = Scattered()[int(pair.id.split("-")[1])]
        if self.metres is None:
            return None
        T = labelled.T_target_source.copy()
        T[:3, 3] += self.metres
        return T


@pytest.mark.parametrize(("metres", "covered"), [(0.0, 0.5), (200.0, 0.0), (None, None), (1e300, 0.0)])
def test_the_pose_found_is_laid_over_the_target(
    tmp_path: Path, metres: float | None, covered: float | None
) -> None:
    done = predict(Off(metres), Scattered(), tmp_path / "rows.jsonl")
    assert [row.overlap_found for row in done] == [covered] * 4
    assert all(row.overlap == pytest.approx(0.5, abs=0.02) for row in done)
