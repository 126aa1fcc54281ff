# SPDX-License-Identifier: MIT
"""A package that is not installed is told as such, never scored as a method that failed."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterator
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg import testing
from hybridreg.candidates.candidates import Candidates
from hybridreg.classical import kiss
from hybridreg.cli.app import app
from hybridreg.eval import stored_table, table_file, table_run
from hybridreg.eval.run import prediction
from hybridreg.io import write_json, write_points
from hybridreg.pair import LabelledPair
from hybridreg.runtime import optional_packages


class Hidden(MetaPathFinder):
    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
        if name.partition(".")[0] in self.names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


@pytest.fixture
def hide(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., None]]:
    """Make modules look as if they were not installed."""

    def hidden(*names: str) -> None:
        monkeypatch.setattr(sys, "meta_path", [Hidden(names), *sys.meta_path])
        for module in [m for m in sys.modules if m.partition(".")[0] in names]:
            monkeypatch.delitem(sys.modules, module)

    kiss._wheel.cache_clear()
    yield hidden
    kiss._wheel.cache_clear()


@pytest.fixture
def pairs() -> list[LabelledPair]:
    pair, T = testing.sample_pair()
    return [LabelledPair(pair=pair, T_target_source=T)]


ROWS = {"row": [{"preset": "kiss-gicp"}, {"preset": "icp"}], "protocols": ["kitti"]}


def test_a_line_whose_package_is_missing_was_not_run(
    hide: Callable[..., None], pairs: list[LabelledPair], tmp_path: Path
) -> None:
    hide("kiss_matcher")
    done = table_run.run(table_file.parse(ROWS), pairs, tmp_path, workers=1)
    assert [entry.name for entry in done.methods] == ["icp"]
    assert "kiss-matcher" in done.problems["kiss-gicp"]
    assert stored_table.load(tmp_path).problems == done.problems
    from hybridreg.eval.report import table_report

    for file in table_report.write(done, table_file.parse(ROWS).protocols, tmp_path, pairs):
        text = file.read_text()
        assert "kiss-gicp" in text, file.name
        assert "hybridreg[kiss]" in text or "no wheel for Python" in text, file.name
        if file.suffix == ".csv":
            row = next(row for row in csv.DictReader(text.splitlines()) if row["method"] == "kiss-gicp")
            assert row["recall"] == ""
            assert row["not run"]


def test_default_says_what_it_ran_without(
    hide: Callable[..., None], pairs: list[LabelledPair], tmp_path: Path
) -> None:
    hide("kiss_matcher")
    done = table_run.run(table_file.parse({"row": [{"preset": "default"}]}), pairs, tmp_path, workers=1)
    assert [entry.name for entry in done.methods] == ["default"]
    assert any("default ran without" in each and "kiss-matcher" in each for each in done.remarks())


def test_nothing_is_said_where_all_is_there(pairs: list[LabelledPair], tmp_path: Path) -> None:
    pytest.importorskip("kiss_matcher")
    assert (
        table_run.run(
            table_file.parse({"row": [{"preset": "default"}]}), pairs, tmp_path, workers=1
        ).remarks()
        == []
    )


def test_every_recipe_missing_is_an_error(hide: Callable[..., None], pairs: list[LabelledPair]) -> None:
    hide("kiss_matcher")
    only = Candidates(of=({"estimate": "kiss"}, {"estimate": {"stage": "kiss", "scale": 2.0}}), refine="none")
    with pytest.raises(ImportError, match="none of its 2 entries can be run here.*kiss-matcher"):
        hr.Pipeline(match="none", estimate=only, refine="none").run(pairs[0].pair)
    some = Candidates(of=({"estimate": "kiss"}, {"estimate": "birdseye"}), refine="none")
    result = hr.Pipeline(match="none", estimate=some, refine="none").run(pairs[0].pair)
    assert any("left out" in note and "kiss-matcher" in note for note in result.notes)


def test_weights_that_are_missing_everywhere_are_an_error(pairs: list[LabelledPair]) -> None:
    pytest.importorskip("torch")
    entry = {"match": {"stage": "geotransformer", "weights": "nowhere"}, "estimate": "lgr"}
    with pytest.raises((ImportError, FileNotFoundError), match="nowhere"):
        hr.Pipeline(match="none", estimate=Candidates(of=(entry,)), refine="none").run(pairs[0].pair)


@pytest.mark.parametrize("workers", [1, 2])
def test_any_method_that_lacks_a_package(pairs: list[LabelledPair], tmp_path: Path, workers: int) -> None:
    with pytest.raises(ImportError, match="nowhere_to_be_found"):
        prediction.predict(_lacking, pairs * 1, tmp_path / "a.jsonl", workers=workers)


def _lacking(pair: hr.Pair, seed: int) -> np.ndarray:
    import nowhere_to_be_found  # type: ignore[import-not-found]

    return np.asarray(nowhere_to_be_found)


@pytest.mark.parametrize(
    "module, preset", [("small_gicp", "icp"), ("open3d", "fpfh-fgr-gicp"), ("torch", "geotransformer")]
)
def test_other_packages(
    hide: Callable[..., None], pairs: list[LabelledPair], tmp_path: Path, module: str, preset: str
) -> None:
    hide(module)
    rows = {"row": [{"preset": preset}]}
    with pytest.raises(ValueError, match=f"none of 1 lines can be run.*{module}|does not come with"):
        table_run.run(table_file.parse(rows), pairs, tmp_path, workers=1)


def test_the_command_line_ends_with_two(
    hide: Callable[..., None], pairs: list[LabelledPair], tmp_path: Path
) -> None:
    hide("kiss_matcher")
    folder = tmp_path / "data" / "one"
    folder.mkdir(parents=True)
    write_points(folder / "source.ply", pairs[0].pair.source.points)
    write_points(folder / "target.ply", pairs[0].pair.target.points)
    write_json(folder / "meta.json", {"T_target_source": pairs[0].T_target_source})
    arguments = [
        "eval",
        "--preset",
        "kiss-gicp",
        "--data",
        str(tmp_path / "data"),
        "--out",
        str(tmp_path / "out"),
    ]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 2, done.output
    assert "kiss-matcher" in done.output


def test_a_python_without_a_wheel_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 13, 1, "final", 0))
    assert (
        optional_packages.cure("kiss_matcher")
        == "kiss-matcher, which has no wheel for Python 3.13: use Python 3.10 to 3.12"
    )
    monkeypatch.setattr(sys, "version_info", (3, 12, 1, "final", 0))
    assert optional_packages.cure("kiss_matcher") == "kiss-matcher: run `pip install 'hybridreg[kiss]'`"


@pytest.mark.parametrize("name", ["=1+1", "@evil", "+a", "-b", "\t=c"])
def test_names_of_lines_are_no_formulas(pairs: list[LabelledPair], tmp_path: Path, name: str) -> None:
    from hybridreg.eval.report import formats

    rows = table_file.parse({"row": [{"preset": "icp", "name": name}], "protocols": ["kitti"], "title": name})
    done = table_run.run(rows, pairs, tmp_path, workers=1, data=name)
    for row in csv.reader(formats.table_csv(done, rows.protocols).splitlines()):
        for each in row:
            assert each[:1] not in ("=", "@", "+", "\t")
            assert each[:1] != "-" or float(each) <= 0.0
