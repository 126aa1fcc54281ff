# SPDX-License-Identifier: MIT
"""Printed figures stand apart, and the tables of the paper are read as they are shipped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from eval_stubs import Scattered

from hybridreg.eval import table_file, table_run
from hybridreg.eval.report import formats, table_report
from hybridreg.eval.score import paper
from hybridreg.io import shipped_weights

PRINTED: dict[str, Any] = {
    "source": "a paper",
    "data": "their data",
    "columns": ["RRE°", "recall %"],
    "rows": {"theirs": [6.683, 87.1]},
}
STILL = {"voxel": 0.5, "match": "none", "estimate": "identity", "refine": "none"}


def test_printed_figures_are_a_table_of_their_own(tmp_path: Path) -> None:
    read = table_file.parse({"base": STILL, "row": [{"name": "ours"}], "paper": PRINTED})
    done = table_run.load(table_folder(read, tmp_path))
    assert done.paper == paper.parse(PRINTED)
    text = formats.markdown(done, read.protocols)
    ours, theirs = text.split("## As printed in a paper, measured on their data: not comparable")
    assert "87.1" not in ours
    assert "| theirs | 6.683 | 87.1 |" in theirs
    assert formats.latex(done, read.protocols).count(r"\begin{table}") == 3
    assert "As printed in a paper" in table_report.html(done, read.protocols)
    assert "theirs" not in formats.table_csv(done, read.protocols)


def table_folder(read: table_file.Recipe, tmp_path: Path) -> Path:
    table_run.run(read, Scattered(1), tmp_path, data="scattered")
    return tmp_path


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"rows": {"a": [1.0]}}, "row 'a' has 1 numbers for 2 columns"),
        ({"when": 1}, "has the keys columns, data"),
    ],
)
def test_a_table_that_is_not_whole_is_refused(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        table_file.parse({"row": [{"preset": "icp"}], "paper": {**PRINTED, **changes}})


@pytest.fixture
def no_weights(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(shipped_weights, "_folder", lambda: tmp_path)


@pytest.fixture
def all_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipped_weights, "require", lambda *_: None)


@pytest.mark.usefixtures("all_weights")
def test_the_ablation_is_the_published_one_and_two_controls() -> None:
    read = table_file.read("ablation")
    assert [line.name[:3] for line in read.lines] == ["(a)", "(b)", "(c)", "(d)", "(e)", "(f)"]
    assert all(line.method is not None for line in read.lines)
    assert read.lines[4].method.oracle  # type: ignore[union-attr]
    assert read.lines[4].name.endswith("†")
    assert not read.lines[5].method.image  # type: ignore[union-attr]
    assert read.paper is not None
    # Every printed row has its line, so that the eye finds it.
    assert list(read.paper.rows) == [line.name for line in read.lines[:4]]
    assert read.paper.rows["(d) OMP, VGAM"] == (6.683, 1.010, 87.2, 70.3)


@pytest.mark.usefixtures("all_weights")
def test_estimators_and_stages_are_whole_grids() -> None:
    estimators = table_file.read("estimators")
    assert len(estimators.lines) == 2 * 3 * 2
    assert all(line.method is not None for line in estimators.lines)
    stages = table_file.read("stages")
    assert len(stages.lines) == 3 * 3 * 3 * 2
    misfits = [line for line in stages.lines if line.method is None]
    # FPFH's matches have no groups, which local-to-global estimation needs.
    assert len(misfits) == 3 * 2
    assert all("fpfh" in line.name and "lgr" in line.name for line in misfits)


@pytest.mark.usefixtures("no_weights")
def test_rows_without_weights_are_told_not_scored(tmp_path: Path) -> None:
    read = table_file.read("stages")
    assert {line.method is None for line in read.lines} == {True, False}
    missing = [line for line in read.lines if "omp" in line.name or "vgam" in line.name]
    assert all(
        "which do not come with this version" in line.problem for line in missing if "lgr" not in line.name
    )
    with pytest.raises(ValueError, match="none of 6 lines can be run; the first: .*geotransformer-small"):
        table_run.run(table_file.read("ablation"), Scattered(1), tmp_path)
    assert not list(tmp_path.iterdir())
