# SPDX-License-Identifier: MIT
"""Every benchmark is a module run from the checkout's root, and says so."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import AGAINST_PEERS
from hybridreg.learned.training import recipe, recipe_file

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = [
    p for p in sorted((ROOT / "benchmarks").glob("*.py")) if "__main__" in p.read_text(encoding="utf-8")
]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted(ROOT.glob("*/README.md"))]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_a_script_names_its_own_command(script: Path) -> None:
    name = "benchmarks" if script.stem == "__main__" else f"benchmarks.{script.stem}"
    text = script.read_text(encoding="utf-8")
    assert re.search(rf"python -m {re.escape(name)}\b", text.split('"""')[1])
    assert "python benchmarks/" not in text


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_pages_name_commands_that_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert "python benchmarks/" not in text
    named = set(re.findall(r"python -m benchmarks\.([a-z_]+)", text))
    assert named <= {script.stem for script in SCRIPTS}


def test_those_that_run_together_exist() -> None:
    assert set(AGAINST_PEERS) <= {script.stem for script in SCRIPTS}


def test_a_checkout_alone_is_enough() -> None:
    """Isolated from PYTHONPATH; the checkout's root is all that the command adds."""
    code = "import sys, runpy; sys.path.insert(0, '.'); sys.argv = ['x', '--help']; "
    code += "runpy.run_module('benchmarks.simulator_speed', run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-I", "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "--workers" in done.stdout


SIZED = {
    script.stem: found[1]
    for script in SCRIPTS
    if (found := re.search(r'"--size", default="([^"]+)"', script.read_text(encoding="utf-8")))
}


@pytest.mark.parametrize(("script", "size"), SIZED.items())
def test_the_size_that_a_script_takes_by_default_is_known(script: str, size: str) -> None:
    importlib.import_module(f"benchmarks.{script}").named_config(size)
    assert len(SIZED) >= 3


def test_training_speed_writes_the_recipe_that_its_options_ask_for(monkeypatch: pytest.MonkeyPatch) -> None:
    training_speed = importlib.import_module("benchmarks.training_speed")
    phases: list[recipe.Phase] = []

    def seen(folder: Path, *_: object) -> float:
        phases.extend(recipe_file.read(folder / "speed.toml").phase)
        return 1.0

    monkeypatch.setattr(training_speed, "_steps_a_second", seen)
    training_speed.main(batch=32, packed=16)
    assert {(each.accumulate, each.packed) for each in phases} == {(32, 16)}
