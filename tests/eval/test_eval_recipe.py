# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import hybridreg as hr
from hybridreg.eval import table_file

BASE = {"match": "none", "estimate": "identity", "refine": "icp"}


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return path


def test_reads_a_file(tmp_path: Path) -> None:
    read = table_file.read(write(tmp_path, """
        title = "Two rows"
        data = "somewhere"
        protocols = ["fine"]
        seed = 4
        starts = 2
        [base]
        preset = "icp"
        voxel = 0.4
        [[row]]
        name = "as it is"
        [[row]]
        refine.iterations = 3
        [[row]]
        preset = "kiss-gicp"
    """))  # fmt: skip
    assert (read.title, read.data, read.seed, read.starts) == ("Two rows", "somewhere", 4, 2)
    assert [p.name for p in read.protocols] == ["fine"]
    assert [line.name for line in read.lines] == ["as it is", "refine iterations=3", "kiss-gicp"]
    first, second, third = (line.method for line in read.lines)
    assert isinstance(first, hr.Pipeline)
    assert first.to_spec() == hr.Pipeline.preset("icp", voxel=0.4).to_spec()
    assert second == hr.Pipeline.preset("icp", voxel=0.4).swap(refine=hr.Icp(iterations=3))
    assert third == hr.Pipeline.preset("kiss-gicp", voxel=0.4)


def test_a_sweep_is_every_combination() -> None:
    axes = {"refine": ["icp", "gicp", "none"], "downsample": {"voxel": [0.3, 0.6]}}
    read = table_file.parse({"base": BASE, "sweep": axes})
    assert [line.name for line in read.lines] == [
        f"refine {r}, downsample voxel={v}" for r in ("icp", "gicp", "none") for v in (0.3, 0.6)
    ]
    assert {(type(p.refine).__name__, p.downsample.voxel) for p in map(_pipeline, read.lines)} == {
        (name, v) for name in ("Icp", "Gicp", "NoRefinement") for v in (0.3, 0.6)
    }


def _pipeline(line: table_file.Line) -> hr.Pipeline:
    assert isinstance(line.method, hr.Pipeline)
    return line.method


def test_a_combination_that_does_not_fit_stays_with_its_reason() -> None:
    read = table_file.parse({"base": {**BASE, "voxel": 0.3}, "sweep": {"downsample": ["voxel", "none"]}})
    fits, misfit = read.lines
    assert fits.method is not None
    assert misfit.method is None
    assert "AllPoints has no voxel" in misfit.problem


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({}, "no [[row]] and no [sweep]"),
        (
            {"rows": []},
            "rows: unknown; a table has base, data, paper, protocols, row, seed, starts, sweep, title",
        ),
        ({"row": [{"preset": "icp"}, {"preset": "icp"}]}, "two rows are called 'icp'"),
        ({"row": [{"preset": "icp", "name": "Identity"}]}, "a row is called 'Identity'"),
        (
            {"row": [{"preset": "icp", "name": "λ=1"}, {"preset": "icp", "name": "μ=1"}]},
            "the rows 'λ=1' and 'μ=1' would both be stored in 1.jsonl; give one another name",
        ),
        (
            {"row": [{"preset": "icp", "name": "GICP"}, {"preset": "icp", "name": "gicp"}]},
            "the rows 'GICP' and 'gicp' would both be stored in gicp.jsonl",
        ),
        (
            {"row": [{"preset": "icp", "refin": "none"}]},
            "refin: unknown; a row has name, preset, pipeline, voxel",
        ),
        ({"base": BASE, "sweep": {"refine": "icp"}}, "sweep refine: expected a list of values, got 'icp'"),
        ({"row": [{"downsample": "none", "voxel": 0.3}]}, "AllPoints has no voxel"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(table: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError) as refused:
        table_file.parse(table)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    "table",
    [{"row": [{"preset": "icq"}]}, {"row": [{}], "protocols": ["kiti"]}, {"row": [{"refine": "gicq"}]}],
)
def test_unknown_names_list_the_known(table: dict[str, Any]) -> None:
    with pytest.raises(KeyError, match="Known: "):
        table_file.parse(table)


def test_a_file_that_is_none_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"mine\.toml: not a TOML file"):
        table_file.read(write(tmp_path, "title ="))
    with pytest.raises(ValueError, match=r"mine\.toml: the table has no"):
        table_file.read(write(tmp_path, "seed = 1"))
    with pytest.raises(FileNotFoundError):
        table_file.read(tmp_path / "none.toml")


def test_the_shipped_table_holds_every_classical_preset() -> None:
    pytest.importorskip("hybridreg.classical.fpfh")
    assert "classical" in table_file.known()
    read = table_file.read("classical")
    names = {
        "icp",
        "fpfh-ransac",
        "fpfh-ransac-gicp",
        "fpfh-fgr-gicp",
        "kiss-gicp",
        "birdseye-gicp",
        "default",
    }
    assert {line.name for line in read.lines} == names
    assert read.starts == 3


@pytest.mark.parametrize(
    ("name", "file"),
    [("KISS + GICP", "kiss-gicp"), ("../x", "x"), ("°", "row"), ("a.b", "a.b"), ("..", "row")],
)
def test_names_become_safe_file_names(name: str, file: str) -> None:
    assert table_file.slug(name) == file
