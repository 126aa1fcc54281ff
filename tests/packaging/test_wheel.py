# SPDX-License-Identifier: MIT
"""The wheel owns one top-level name and carries what the library reads at run time."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Names of the files in a wheel built from a copy of the tracked files."""
    pytest.importorskip("setuptools")
    out = tmp_path_factory.mktemp("wheel")
    copy = out / "copy"
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if tracked.returncode != 0:
        pytest.skip("not a git checkout")
    for name in tracked.stdout.splitlines():
        if (ROOT / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).write_bytes((ROOT / name).read_bytes())
    build = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(out),
        str(copy),
    ]
    subprocess.run(build, check=True, capture_output=True)
    with zipfile.ZipFile(next(out.glob("*.whl"))) as z:
        return z.namelist()


def test_one_top_level_name(wheel: list[str]) -> None:
    tops = {name.partition("/")[0] for name in wheel}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"hybridreg"}


def test_every_module_of_the_checkout_is_in_it(wheel: list[str]) -> None:
    for folder in ("hybridreg", "classical", "learned", "eval"):
        for file in (ROOT / folder).rglob("*"):
            inside = file.relative_to(ROOT)
            if not file.is_file() or "__pycache__" in inside.parts:
                continue
            name = inside.as_posix() if folder == "hybridreg" else f"hybridreg/{inside.as_posix()}"
            assert name in wheel, name
