# SPDX-License-Identifier: MIT
"""`import hybridreg` is light, and there is one copy of everything."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import hybridreg

ROOT = Path(__file__).resolve().parents[2]
HEAVY = {
    "torch",
    "open3d",
    "sklearn",
    "cv2",
    "small_gicp",
    "kiss_matcher",
    "kiss_icp",
    "matplotlib",
    "plotly",
    "typer",
}


def run(code: str, *flags: str) -> str:
    done = subprocess.run(
        [sys.executable, *flags, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "module", ["hybridreg", "hybridreg.pipeline", "hybridreg.eval", "hybridreg.classical"]
)
def test_import_loads_nothing_heavy_and_warns_of_nothing(module: str) -> None:
    loaded = json.loads(
        run(f"import json, sys, {module}; print(json.dumps(list(sys.modules)))", "-W", "error")
    )
    assert not HEAVY & {name.partition(".")[0] for name in loaded}


def test_every_public_name_exists() -> None:
    for name in hybridreg.__all__:
        assert getattr(hybridreg, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'regster'"):
        _ = hybridreg.regster


def test_type_checkers_find_every_public_name() -> None:
    """A name that a typed package imports without "as" is private to them: `hr.register` was an error."""
    shown = [
        alias.name
        for node in ast.walk(ast.parse(Path(hybridreg.__file__).read_text()))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hybridreg.")
        for alias in node.names
        if alias.name == alias.asname
    ]
    assert sorted([*shown, "__version__"]) == hybridreg.__all__


def test_public_names_did_not_vanish() -> None:
    promised = {
        "register",
        "Pipeline",
        "PointCloud",
        "Pair",
        "LabelledPair",
        "RegistrationResult",
        "VoxelGrid",
    }
    assert promised <= set(hybridreg.__all__)


def test_one_name_at_the_top() -> None:
    run("import hybridreg.classical.voxel, sys; assert 'classical' not in sys.modules")


def test_a_bare_import_of_our_folders_is_banned(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("import classical\n")
    ruff = [sys.executable, "-m", "ruff", "check", "--config", str(ROOT / "pyproject.toml"), str(tmp_path)]
    done = subprocess.run(ruff, capture_output=True, text=True, check=False)
    if "No module named ruff" in done.stderr:
        pytest.skip("ruff is not installed")
    assert "TID251" in done.stdout, done.stdout + done.stderr


def test_no_module_of_ours_imports_them_bare() -> None:
    for folder in ("hybridreg", "classical", "learned", "eval", "tests", "benchmarks"):
        for file in (ROOT / folder).rglob("*.py"):
            for line in file.read_text().splitlines():
                assert line.split()[:2] not in (["import", "classical"], ["from", "classical"]), file


def test_without_open3d_the_rest_works() -> None:
    blocked = (
        "import sys; sys.modules['open3d'] = None\n"
        "import hybridreg as hr, hybridreg.testing as t\n"
        "pipe = hr.Pipeline(voxel=0.4, match='given', estimate='ransac', refine='icp')\n"
        "scene, T = t.sample_scene()\n"
        "print(pipe.run(t.sample_pair()[0], matches=t.true_matches(scene, T)).verdict)\n"
        "try: hr.Pipeline(voxel=0.4).run(t.sample_pair()[0])\n"
        "except ImportError as error: print(error)\n"
    )
    verdict, message = run(blocked).strip().splitlines()
    assert verdict == "ok"
    assert "open3d" in message
    assert "hybridreg[open3d]" in message
