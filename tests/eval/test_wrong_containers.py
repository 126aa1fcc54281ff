# SPDX-License-Identifier: MIT
"""What is given instead of pairs, rows, clouds or a stage is named, with what to give."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.data import PairFolder
from hybridreg.eval import predict, protocol, read, score

DEMO = PairFolder(Path(str(hr.__path__[0])) / "data")
CLOUD = np.random.default_rng(0).uniform(-9.0, 9.0, (300, 3))


def still(pair: hr.Pair, seed: int) -> Any:
    return np.eye(4)


@pytest.mark.parametrize(
    ("pairs", "problem"),
    [
        ("mine/val", r"pairs 'mine/val': hybridreg\.data\.open_dataset"),
        (Path("mine"), r"pairs 'mine': hybridreg\.data\.open_dataset"),
        ((pair for pair in DEMO), "expected a data set or a list of LabelledPair, got generator"),
        (DEMO[0], "expected a data set or a list of LabelledPair, got LabelledPair"),
        ([DEMO[0].pair], "expected LabelledPair, got Pair among them"),
    ],
    ids=["text", "path", "generator", "one", "pairs without truth"],
)
def test_pairs(pairs: Any, problem: str, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match=problem):
        predict(still, pairs, tmp_path / "rows.jsonl")
    assert not list(tmp_path.iterdir())


def test_rows_come_from_predict_or_from_read(tmp_path: Path) -> None:
    path = tmp_path / "rows.jsonl"
    rows, rule = predict(still, DEMO, path), protocol("kitti")
    wanted = score(rows, rule)
    assert score(read(path), rule).rre_deg_all == wanted.rre_deg_all
    assert score((row for row in rows), rule).n == 1  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="rows: expected what predict or read returned, got str among them"):
        score(str(path), rule)  # type: ignore[arg-type]
    assert score(rows, "kitti").rre_deg_all == wanted.rre_deg_all
    with pytest.raises(KeyError, match=r"no protocol is called 'kiti'\. Known: .*kitti"):
        score(rows, "kiti")
    with pytest.raises(TypeError, match=r"protocol 2\.0: expected one such as hybridreg\.eval\.protocol"):
        score(rows, 2.0)  # type: ignore[arg-type]


def test_a_pair_is_found_by_its_number() -> None:
    with pytest.raises(TypeError, match=r"pair 'demo': pairs have numbers; its own is pairs\.ids\.index"):
        DEMO["demo"]  # type: ignore[call-overload]
    assert DEMO[np.int64(0)].pair.id == "demo"  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("clouds", "problem"),
    [
        ({"a": CLOUD, "b": CLOUD}, r"give clouds=list\(x\.values\(\)\) and names=list\(x\)"),
        ("scans/*.pcd", r"'scans/\*\.pcd' is one path, two or more are needed; give a list"),
        (CLOUD, r"one array of shape \(300, 3\); give a list of two clouds or more"),
        ((CLOUD for _ in range(1)), "1 given, two or more are needed"),
    ],
    ids=["mapping", "pattern", "one cloud", "generator"],
)
def test_many_clouds(clouds: Any, problem: str) -> None:
    with pytest.raises(ValueError, match=f"clouds: .*{problem}|clouds: {problem}"):
        hr.register_all(clouds)


def test_a_stage_is_an_object_and_a_pair_is_no_labelled_one() -> None:
    with pytest.raises(ValueError, match=r"refine: Gicp is a class; give an object of it, such as Gicp\(\)"):
        hr.Pipeline(refine=hr.Gicp)
    pipe = hr.Pipeline(match="none", estimate="identity", refine="none")
    for run in (pipe.run, pipe.trace):
        with pytest.raises(TypeError, match="pair: expected a Pair, got LabelledPair; give its pair"):
            run(DEMO[0])  # type: ignore[operator]
