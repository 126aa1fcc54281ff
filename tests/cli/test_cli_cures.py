# SPDX-License-Identifier: MIT
"""On the command line a message's cure is an option that is there, and that cures."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from hybridreg import testing
from hybridreg.cli.app import app
from hybridreg.cli.terminal.command_line_cures import WORDS, spoken

ROOT = Path(__file__).parents[2]
IDENTITY = ["--set", "match=none", "--set", "estimate=identity", "--set", "refine=none"]


def register(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["register", *map(str, arguments)])


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
    for said, _ in WORDS:
        core = said.split("=(")[0].replace(r"\b", "").replace("(smaller|larger)", "smaller").replace("\\", "")
        assert core in source or core.replace("smaller", "larger") in source, said


def test_every_option_exists() -> None:
    known = register("--help").output
    for option in {each for _, means in WORDS for each in re.findall(r"--[a-z-]+", means)}:
        assert option in re.sub(r"\x1b\[[0-9;]*m", "", known), option


def test_points_that_are_not_finite(cloud: Path) -> None:
    done = register(cloud / "half.npy", cloud / "whole.npy", *IDENTITY)
    assert done.exit_code == 2
    assert "pass --nonfinite drop" in done.output
    cured = register(cloud / "half.npy", cloud / "whole.npy", *IDENTITY, "--nonfinite", "drop")
    assert cured.exit_code in (0, 3)


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


def test_what_needs_no_translation_stays() -> None:
    assert spoken("target: 3 points are too few") == "target: 3 points are too few"
