# SPDX-License-Identifier: MIT
"""Printed figures stand apart, and the tables of the paper are read as they are shipped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from eval_stubs import Scattered

from hybridreg.eval import stored_table, table_file, table_run
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
    done = stored_table.load(table_folder(read, tmp_path))
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
def test_table_4_stands_as_published_and_ours_with_two_controls_each() -> None:
    read = table_file.read("table4")
    letters = ["(a)", "(b)", "(c)", "(d)", "(d)", "(d)"]
    assert [line.name[:3] for line in read.lines] == 2 * letters
    methods: list[Any] = [line.method for line in read.lines]
    for part, published in ((methods[:6], True), (methods[6:], False)):
        pipelines = [getattr(method, "pipeline", method) for method in part]
        assert [pipe.match.as_published for pipe in pipelines] == 6 * [published]
        assert [getattr(pipe.overlap, "as_published", None) for pipe in pipelines[1:5]] == 4 * [published]
        assert not part[4].image
        assert part[5].oracle
        # LGR has the numbers that the weights were validated with in training.
        for pipe in pipelines:
            assert pipe.estimate.config(0.3) == pipe.match.network().config.lgr
    assert all(line.name.endswith("†") for line in (read.lines[5], read.lines[11]))
    assert read.paper is not None
    # Every printed row has its lines, so that the eye finds them.
    assert [f"{name}, as published" for name in read.paper.rows] == [line.name for line in read.lines[:4]]
    assert read.paper.rows["(d) OMP, VGAM"] == (6.683, 1.010, 87.2, 70.3)


@pytest.mark.usefixtures("all_weights")
def test_tables_2_and_3_have_every_printed_row_and_ours_beside() -> None:
    for name, printed, ours in (("table2", 9, 3), ("table3", 11, 6)):
        read = table_file.read(name)
        assert read.paper is not None
        names = [line.name for line in read.lines]
        assert names[:printed] == list(read.paper.rows)
        assert len(names) == printed + ours
        assert all(line.method is not None for line in read.lines)
    fifty = [line.method for line in table_file.read("table3").lines if line.name.startswith("RANSAC-50K")]
    assert {type(method.estimate).__name__ for method in fifty} == {"Ransac50k"}  # type: ignore[union-attr]


@pytest.mark.usefixtures("all_weights")
def test_stages_are_a_whole_grid_and_lgr_follows_fpfh() -> None:
    stages = table_file.read("stages")
    assert len(stages.lines) == 3 * 3 * 3 * 2
    assert [line.problem for line in stages.lines if line.method is None] == []
    assert [line.name for line in stages.lines if "fpfh" in line.name and "lgr" in line.name]


@pytest.mark.usefixtures("no_weights")
def test_rows_without_weights_are_told_not_scored(tmp_path: Path) -> None:
    read = table_file.read("stages")
    assert {line.method is None for line in read.lines} == {True, False}
    missing = [line for line in read.lines if "omp" in line.name or "vgam" in line.name]
    assert all("which do not come with this version" in line.problem for line in missing)
    with pytest.raises(ValueError, match="none of 12 lines can be run; the first: .*geotransformer-small"):
        table_run.run(table_file.read("table4"), Scattered(1), tmp_path)
    assert not list(tmp_path.iterdir())
