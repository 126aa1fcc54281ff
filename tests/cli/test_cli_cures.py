# SPDX-License-Identifier: MIT
"""On the command line a message's cure is an option that is there, and that cures."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.cli.terminal.command_line_cures import CURES, VALUES, options_in, spoken

ROOT = Path(__file__).parents[2]
IDENTITY = ["--set", "match=none", "--set", "estimate=identity", "--set", "refine=none"]


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def register(*arguments: str | Path) -> Result:
    return call("register", *arguments)


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    points = testing.sample_pair()[0].target.points.copy()
    np.save(tmp_path / "whole.npy", points)
    points[::2] = np.nan
    np.save(tmp_path / "half.npy", points)
    return tmp_path


def test_every_phrase_is_one_that_the_library_says() -> None:
    folders = ("hybridreg", "classical", "learned")
    source = "\n".join(
        file.read_text()
        for each in folders
        for file in (ROOT / each).rglob("*.py")
        if "cli" not in file.parts
    )
    source = re.sub(r'"\s*\n\s*f?"', "", source)
    for said, _ in (*CURES, *VALUES):
        core = (
            re.split(r"='?\(", said)[0]
            .replace(r"\b", "")
            .replace("(smaller|larger)", "smaller")
            .replace("\\", "")
        )
        assert core in source or core.replace("smaller", "larger") in source, said


@pytest.mark.parametrize(
    "array, cure",
    [
        (
            np.ones((2, 20, 25, 3)),
            "save one cloud of the batch, a point a row, of the file's array x: x[0].reshape(-1, 3)",
        ),
        (np.ones((2, 3, 20, 25)), "of the file's array x: x[0].reshape(3, -1).T"),
        (np.ones((8, 3, 50)), "save one, a point a row, of the file's array x: x[0].T"),
        (
            np.random.default_rng(0).uniform(size=(9, 50, 3)),
            "save one of the file's array x, x[0], to a file",
        ),
        (np.full((50, 4), 0.5), "by the fourth, and save the file again with x[..., :3] / x[..., 3:]"),
        (
            np.zeros(60, [(axis, "f4", 2) for axis in "xyz"]),
            "and save the file again with numpy.column_stack([x[",
        ),
    ],
)
def test_cures_for_the_array_in_a_file(array: np.ndarray, cure: str, cloud: Path) -> None:
    np.save(cloud / "a.npy", array)
    assert cure in " ".join(register(cloud / "a.npy", cloud / "whole.npy").stderr.split())


def test_every_option_exists() -> None:
    known = "".join(call(name, "--help").output for name in ("register", "together", "train"))
    for means in (*(each for _, several in CURES for each in several), *(named for _, named in VALUES)):
        for option in options_in(means):
            assert option in re.sub(r"\x1b\[[0-9;]*m", "", known), option


def test_points_that_are_not_finite(cloud: Path) -> None:
    done = register(cloud / "half.npy", cloud / "whole.npy", *IDENTITY)
    assert done.exit_code == 2
    assert "pass --nonfinite drop" in done.output
    cured = register(cloud / "half.npy", cloud / "whole.npy", *IDENTITY, "--nonfinite", "drop")
    assert cured.exit_code in (0, 3)


def test_points_that_are_not_finite_by_commands_with_another_option(cloud: Path) -> None:
    files, out = (cloud / "half.npy", cloud / "whole.npy"), ("--out", cloud / "out")
    said = " ".join(call("together", *files, *IDENTITY, *out).output.split())
    assert "remove them or pass --drop" in said
    assert call("together", *files, *IDENTITY, *out, "--drop").exit_code in (0, 3)
    shutil.rmtree(cloud / "out")
    done = call("batch", cloud / "half.npy", "--target", cloud / "whole.npy", *IDENTITY, *out)
    assert "remove them or pass --drop" in " ".join(done.output.split())
    assert "remove them or pass --drop" in (cloud / "out" / "poses.csv").read_text()


def test_points_that_are_not_finite_where_no_option_drops_them(cloud: Path) -> None:
    pair = cloud / "data" / "one"
    pair.mkdir(parents=True)
    (cloud / "half.npy").rename(pair / "source.npy")
    (cloud / "whole.npy").rename(pair / "target.npy")
    (pair / "meta.json").write_text(json.dumps({"T_target_source": np.eye(4).tolist()}))
    done = call("eval", "--data", f"{pair.parent}#trusted", *IDENTITY, "--out", cloud / "run")
    said = " ".join(done.output.split())
    assert "remove them" in said
    assert "nonfinite" not in said
    assert "nonfinite=" not in "".join(file.read_text() for file in (cloud / "run").rglob("*.jsonl"))


@pytest.mark.parametrize(
    "row, said",
    [
        ('voxel = "x"', "voxel='x' must be"),
        ("prior = { max_rotation = -3 }", "max_rotation=-3 must be"),
        ('match = { stage = "geotransformer", size = "nano" }', "insist with untrained = true"),
    ],
)
def test_a_file_of_a_table_has_keys_and_no_options(row: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(f"[[row]]\n{row}\n")
    done = call("table", tmp_path / "x.toml", "--data", tmp_path, "--out", tmp_path / "run")
    told = " ".join(done.output.split())
    assert done.exit_code == 2
    assert said in told
    assert "--" not in told


def test_a_value_of_a_pipelines_file_is_no_options(cloud: Path) -> None:
    (cloud / "p.toml").write_text("[prior]\nmax_rotation = -3\n")
    done = register(cloud / "whole.npy", cloud / "whole.npy", "--pipeline", cloud / "p.toml")
    assert "max_rotation=-3 must be" in " ".join(done.output.split())
    both = register(cloud / "whole.npy", cloud / "whole.npy", "--pipeline", "p.toml", "--preset", "icp")
    assert "--preset icp and --pipeline p.toml: leave one of them out" in " ".join(both.output.split())


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--voxel", "500"], "smaller --voxel"),
        (["--voxel", "1e-9"], "larger --voxel"),
        (["--voxel", "-1"], "--voxel -1.0 must be"),
        (["--seed", "-1"], "--seed -1 must be"),
        (["--set", "match=given"], "only Python can give"),
        (["--set", "match=geotransformer"], "--set SLOT.weights=... these weights are random"),
    ],
)  # fmt: skip
def test_cures_name_options(cloud: Path, arguments: list[str], words: str) -> None:
    done = register(cloud / "whole.npy", cloud / "whole.npy", *IDENTITY, *arguments)
    assert done.exit_code == 2, done.output
    assert words in " ".join(done.output.split())


@pytest.mark.parametrize(
    "array, words",
    [
        (np.full((50, 3), "1.5"), "save the file again with x.astype(float) of its array x"),
        (np.full((50, 3), "a"), "save the file again as an array of numbers, one row x, y, z a point"),
        (np.ones((2, 50, 3)), "of the file's array x, save one, x[0], to a file of its own, or all as one"),
        (np.ones((50, 3), dtype=complex), "save the file again with the real part of its array x: x.real"),
        (np.ones(60), "one point after another, save the file again with x.reshape(-1, 3)"),
        (np.ones((50, 2)), "needs three coordinates: save the file again with x, y and z of each point"),
        (np.ones((9, 50, 2)), "save the file again with one row x, y, z a point"),
        (np.ones((10, 50)), "if they are channels, save the file again with x[:3].T of its array x"),
        (np.column_stack([np.arange(50), np.ones((50, 3))]), "save the file again with columns 2 to 4"),
    ],
)
def test_what_to_do_with_an_array_is_told_of_its_file(cloud: Path, array: np.ndarray, words: str) -> None:
    np.save(cloud / "odd.npy", array)
    done = register(cloud / "odd.npy", cloud / "whole.npy", *IDENTITY)
    assert done.exit_code == 2, done.output
    assert words in " ".join(done.output.split())


def test_what_needs_no_translation_stays() -> None:
    assert spoken("target: 3 points are too few") == "target: 3 points are too few"
