# SPDX-License-Identifier: MIT
"""A table or a training on data of the wrong direction stops before the first pair; failures alone are no success."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from hybridreg.cli import main

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "data"))
import loader_trees

CURE = "the poses seem to map target to source, open the data set with inverted=yes"


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    return int(left.value.code or 0), capsys.readouterr().err


@pytest.fixture(scope="session")
def inverted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return loader_trees.cross3dreg(tmp_path_factory.mktemp("inverted"), inverted=True).root


@pytest.mark.parametrize("how", ["table", "eval"])
def test_a_table_stops_before_the_first_pair_with_inspects_words(
    how: str, inverted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    what = {"table": ("table", "classical"), "eval": ("eval", "--preset", "icp")}[how]
    code, said = run(capsys, *what, "--data", f"cross3dreg:{inverted}", "--out", str(tmp_path / "run"))
    assert code == 2
    assert CURE in " ".join(said.split())
    assert not list(tmp_path.rglob("*.jsonl"))


def test_training_stops_too(inverted: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("lightning_fabric")
    recipe = tmp_path / "r.toml"
    recipe.write_text(
        f'base = "smoke"\n[data]\ntrain = [{{ data = "cross3dreg:{inverted}", name = "x" }}]\nval = []\n'
    )
    code, said = run(capsys, "train", str(recipe), "--out", str(tmp_path / "run"), "--accelerator", "cpu")
    assert code == 2
    assert CURE in " ".join(said.split())


def test_a_table_of_nothing_but_failures_ends_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = loader_trees.cross3dreg(tmp_path / "tree").root
    for file in (root / "sequences" / "08" / "array").iterdir():
        file.write_bytes(b"ply\nbroken")
    code, said = run(
        capsys, "eval", "--preset", "icp", "--data", f"cross3dreg:{root}", "--out", str(tmp_path / "run")
    )
    assert code == 2
    assert "all 3 rows failed; the first, 08/000000-000000 by icp: ValueError" in " ".join(said.split())
    assert (tmp_path / "run" / "table.md").is_file()
