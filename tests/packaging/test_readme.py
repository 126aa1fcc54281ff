# SPDX-License-Identifier: MIT
"""Every command and every line of Python in the README runs as it stands there, on the pair that is shipped."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hybridreg.io import point_files
from hybridreg.output.pose_text import FORMATS
from hybridreg.runtime.open3d import load_open3d

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FORMATS_PAGE = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")

# What starts so is not run here, and why.
NOT_RUN = {
    "make demo": "installs; CI runs what it installs",
    "make test": "is this",
    "hybridreg train smoke": "trains; tests/learned does it",
    "hybridreg train warm-up": "takes an hour",
}


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


COMMANDS = [line.strip() for block in blocks("sh") for line in block.splitlines() if line.strip()]


def skipped(line: str) -> bool:
    return line.startswith(tuple(NOT_RUN))


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that looks like a fresh clone, in which `hybridreg demo --out out/demo` was run."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("hybridreg", "classical", "learned", "eval", "pyproject.toml"):
        (folder / name).symlink_to(ROOT / name)
    assert any(line.startswith("hybridreg demo --out out/demo") for line in COMMANDS)
    shell("hybridreg demo --out out/demo", folder)
    return folder


def shell(command: str, folder: Path) -> str:
    tools = folder / "bin"
    if not tools.exists():
        tools.mkdir()
        (tools / "hybridreg").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m hybridreg "$@"\n')
        (tools / "hybridreg").chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(folder),
    }
    done = subprocess.run(
        ["sh", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("command", [line for line in COMMANDS if not skipped(line)])
def test_commands(command: str, clone: Path) -> None:
    shutil.rmtree(clone / "out" / "table", ignore_errors=True)
    shell(command, clone)


def test_python(clone: Path) -> None:
    """All blocks in one process, in their order, as a reader would type them."""
    pytest.importorskip("torch")
    pytest.importorskip("cv2")
    try:
        load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    (clone / "readme.py").write_text("\n".join(blocks("python")))
    environment = {**os.environ, "PYTHONPATH": str(clone)}
    done = subprocess.run(
        [sys.executable, "readme.py"], cwd=clone, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.startswith("ok ")


def test_what_is_not_run_stands_there() -> None:
    assert [start for start in NOT_RUN if not any(line.startswith(start) for line in COMMANDS)] == []


def test_it_is_short_and_says_the_most_surprising_thing_first() -> None:
    lines = README.splitlines()
    assert len(lines) <= 150
    assert "The camera image has no effect in these weights yet" in "\n".join(lines[:15])


def test_what_ci_runs_stands_there() -> None:
    path = ROOT / ".ci" / "run"
    if not path.exists():
        pytest.skip("not a checkout")
    assert "\nmake test\n" in path.read_text()
    assert any(line.startswith("make test ") for line in COMMANDS)


def test_the_table_of_formats_names_every_ending_and_every_pose() -> None:
    table = FORMATS_PAGE.partition("# Formats")[2].partition("\n## ")[0].lower()
    words = {"arrow": "feather", "db3": "sqlite", "bag": "bags", "gltf": "glb"}
    for ending in (*point_files.PARSERS, *point_files.READERS):
        name = ending.removeprefix(".")
        if name in ("tsv", "xyzn", "xyzrgb", "xyzi"):  # "..."
            continue
        assert words.get(name, name) in table, ending
    for form in FORMATS:
        assert form.removesuffix("-tf") in table, form
