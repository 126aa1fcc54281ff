# SPDX-License-Identifier: MIT
"""`hybridreg simulate`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from hybridreg.cli.app import app
from hybridreg.data import open_dataset
from hybridreg.data.simulate import Drawn, simulated_folder
from hybridreg.data.simulate.sensing.jpeg import encode


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["simulate", *(str(a) for a in arguments)])


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Stands in for the drawing, which has its own tests; tells what was drawn."""
    numbers: list[int] = []
    points = np.random.default_rng(0).integers(-2000, 2000, (900, 3)).astype(np.float32) / 256
    blank = encode(np.full((288, 512, 3), 90, np.uint8), 80)
    plain = Drawn(points, points, blank, np.eye(4), 1.0, "street", "mems-fan", "hdl64e", 2)

    def draw(_: str, number: int) -> Drawn:
        numbers.append(number)
        return replace(plain, source=points[: 500 + number % 100])

    monkeypatch.setattr(simulated_folder, "draw", draw)
    return numbers


def test_writes_pairs_that_open_as_a_data_set(tmp_path: Path, drawn: list[int]) -> None:
    result = call("--tier", "mid", "--pairs", "3", "--seed", "1", "--out", tmp_path / "set")
    assert result.exit_code == 0, result.output
    assert f"written to {tmp_path / 'set'}: 3 pairs" in result.stdout
    pairs = open_dataset(tmp_path / "set")
    assert [p.pair.id for p in pairs] == [f"mid-train-1-00000{k}" for k in range(3)]
    assert [len(p.pair.source) for p in pairs] == [500 + number % 100 for number in drawn]
    assert all(p.pair.image is not None for p in pairs)


def test_goes_on_where_it_was_cut_off(tmp_path: Path, drawn: list[int]) -> None:
    assert call("--pairs", "2", "--out", tmp_path).exit_code == 0
    # What a killed process leaves behind.
    (tmp_path / ".mid-train-1-000002-0123abcd").mkdir()
    (tmp_path / ".mid-train-1-000002-0123abcd" / "source.npz").write_bytes(b"half")
    assert call("--pairs", "4", "--out", tmp_path).exit_code == 0
    assert len(drawn) == len(set(drawn)) == 4
    assert len(open_dataset(tmp_path)) == 4


def test_other_splits_and_seeds_are_other_pairs(tmp_path: Path, drawn: list[int]) -> None:
    for given in (("--split", "val"), ("--split", "test"), ("--seed", "2"), ()):
        assert call(*given, "--pairs", "1", "--out", tmp_path).exit_code == 0
    assert len(set(drawn)) == 4
    assert len(open_dataset(tmp_path)) == 4


def test_refuses_to_mix_what_was_thinned_otherwise(tmp_path: Path, drawn: list[int]) -> None:
    assert call("--pairs", "1", "--voxel", "0.25", "--out", tmp_path).exit_code == 0
    result = call("--pairs", "1", "--out", tmp_path)
    assert result.exit_code == 2
    assert "voxel 0.25, not None; write to another folder" in result.stderr
    assert len(drawn) == 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--tier", "nearby"], "'nearby'; the tiers are near, mid"),
        (["--split", "exam"], "'exam'; the splits are train, val, test"),
        (["--split", "test", "--seed", "1000"], "seed 1000 is outside split 'test'"),
        (["--seed", "-1"], "seed -1"),
        (["--voxel", "0"], "voxel=0.0"),
        (["--pairs", "1000001"], "pair 1000000"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(tmp_path: Path, given: list[str], said: str) -> None:
    result = call(*given, "--out", tmp_path / "set")
    assert result.exit_code == 2
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "set").exists()
