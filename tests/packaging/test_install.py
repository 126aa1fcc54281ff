# SPDX-License-Identifier: MIT
"""A plain install is light, its extras are complete, and what is not installed says how to get it."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import CliRunner

import hybridreg as hr
from hybridreg.cli.app import app
from hybridreg.io.structured import read_toml
from hybridreg.runtime import optional_packages

ROOT = Path(__file__).resolve().parents[2]
PROJECT = read_toml(ROOT / "pyproject.toml")["project"]
EXTRAS = PROJECT["optional-dependencies"]
HEAVY = (
    "torch",
    "open3d",
    "cv2",
    "sklearn",
    "plotly",
    "matplotlib",
    "kiss_matcher",
    "kiss_icp",
    "safetensors",
)


def distributions(*requirements: str) -> set[str]:
    """Names of distributions, those of our own extras included."""
    found = set()
    for each in requirements:
        ours = re.match(r"hybridreg\[([\w,]+)\]", each)
        if ours:
            found |= distributions(*(r for extra in ours[1].split(",") for r in EXTRAS[extra]))
        else:
            found.add(re.split(r"[\[<>=;~ ]", each)[0])
    return found


def test_version_is_told_once_everywhere() -> None:
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.output) == (0, f"hybridreg {hr.__version__}\n")
    assert hr.__version__ == PROJECT["version"]
    assert f"version: {hr.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {hr.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_all_holds_every_extra_that_users_install() -> None:
    users = [extra for extra in EXTRAS if extra not in ("all", "test", "dev")]
    assert distributions(*EXTRAS["all"]) == distributions(*(r for extra in users for r in EXTRAS[extra]))
    card = {
        "open3d",
        "numpy",
        "scipy",
        "scikit-learn",
        "opencv-python-headless",
        "torch",
        "kiss-icp",
        "pytest",
    }
    assert card <= distributions(*PROJECT["dependencies"], *EXTRAS["all"], *EXTRAS["test"])


@pytest.mark.parametrize("module", sorted(optional_packages._DISTRIBUTIONS))
def test_the_extra_that_is_named_brings_the_package(module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    distribution, extra, last = optional_packages._DISTRIBUTIONS[module]
    brought = distributions(*(EXTRAS[extra] if extra else PROJECT["dependencies"]))
    assert distribution in brought
    assert not extra or distribution not in distributions(*PROJECT["dependencies"])
    for minor in (10, 11, 12, 13):
        monkeypatch.setattr(sys, "version_info", (3, minor, 0, "final", 0))
        told = optional_packages.cure(f"{module}.part")
        if last and minor > last[1]:
            assert f"no wheel for Python 3.{minor}" in told
            assert "pip install" not in told
        else:
            assert f"'hybridreg[{extra}]'" in told if extra else "pip install" in told


def blocked(code: str) -> list[str]:
    """Lines that a program prints where none of the heavy packages can be found."""
    start = f"""
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {HEAVY!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Hidden())
import hybridreg as hr
pair = ["hybridreg/data/demo/%s.npz" % each for each in ("source", "target")]
"""
    done = subprocess.run(
        [sys.executable, "-c", start + code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_register_and_its_verdict_need_none_of_the_heavy_packages() -> None:
    assert blocked("print(hr.register(*pair).verdict)") == ["ok"]


@pytest.mark.parametrize(
    "code, extra",
    [
        ("hr.Pipeline.preset('cross3dreg')(*pair)", "learned"),
        ("hr.Pipeline.preset('geotransformer', voxel=0.5)(*pair)", "learned"),
        ("hr.Pipeline(match=hr.Fcgf(untrained=True))(*pair)", "learned"),
        ("hr.Pipeline(match='none', estimate=hr.OmNet(untrained=True))(*pair)", "learned"),
        ("hr.Pipeline(voxel=0.5)(*pair)", "open3d"),
        ("hr.Pipeline(match='none', estimate='kiss', voxel=0.5)(*pair)", "kiss"),
        ("hr.Pipeline(match='none', estimate='identity', refine='kiss-icp', voxel=0.5)(*pair)", "kiss"),
        ("hr.Pair.of(*pair, 'hybridreg/data/demo/image.jpg').image.shape", "image"),
    ],
)
def test_what_needs_more_says_which_extra(code: str, extra: str) -> None:
    told = blocked(f"try: {code}\nexcept ImportError as error: print(error)")
    assert told, "it ran"
    assert f"pip install 'hybridreg[{extra}]'" in told[-1] or "no wheel for Python" in told[-1], told


def test_the_command_line_says_it_too() -> None:
    code = "from hybridreg.cli import main\nsys.stderr = sys.stdout\n"
    code += "try: main({})\nexcept SystemExit as error: print(error.code)"
    pair = [f"hybridreg/data/demo/{each}.npz" for each in ("source", "target")]
    told = blocked(code.format(["register", *pair, "--preset", "cross3dreg"]))
    assert told[-1] == "2"
    assert "hybridreg[learned]" in told[-2]
    told = blocked(code.format(["doctor"]))
    assert [line for line in told if "torch" in line and "hybridreg[learned]" in line]
    assert [line for line in told if "scikit-learn" in line and "hybridreg[train]" in line]
    assert told[-1] != "2"


@pytest.mark.skipif(
    find_spec("build") is None or find_spec("twine") is None, reason="build and twine are not here"
)
def test_what_would_be_uploaded_is_in_order(tmp_path: Path) -> None:
    make = [
        sys.executable,
        "-W",
        "error::DeprecationWarning",
        "-m",
        "build",
        "--no-isolation",
        "-o",
        str(tmp_path),
    ]
    done = subprocess.run([*make, str(ROOT)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "DeprecationWarning" not in done.stdout + done.stderr
    files = sorted(map(str, tmp_path.iterdir()))
    check = [sys.executable, "-m", "twine", "check", "--strict", *files]
    assert subprocess.run(check, capture_output=True, text=True, check=False).returncode == 0
    assert [Path(file).suffix for file in files] == [".whl", ".gz"]
