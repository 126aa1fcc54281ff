# SPDX-License-Identifier: MIT
from __future__ import annotations

import dataclasses
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hybridreg import registry
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.slots import SLOTS

ROOT = Path(__file__).resolve().parent.parent

PLUGIN = """
from dataclasses import dataclass
import numpy as np
from hybridreg.matches import Correspondences

@dataclass(frozen=True, kw_only=True)
class Mine:
    n: int = 3
    gives = frozenset({"matches"})
    def __call__(self, scene, overlap):
        return Correspondences.of(scene.source.points[:self.n], scene.target.points[:self.n])
"""

USE = """
import hybridreg as hr
from hybridreg import registry, testing
assert "mine" in registry.names("match"), registry.names("match")
pipe = hr.Pipeline(match={"stage": "mine", "n": 40}, estimate="svd", refine="none", voxel=0.4)
trace = pipe.trace(testing.sample_pair()[0])
assert len(trace.matches) == 40
assert pipe.to_spec()["match"] == {"stage": "mine", "n": 40}
testing.check_stage(pipe.match)
print("plugged in")
"""


@pytest.mark.parametrize("key", sorted(registry.BUILT_IN))
def test_every_built_in_stage_loads_and_knows_its_name(key: str) -> None:
    slot, _, name = key.partition(".")
    assert slot in SLOTS
    cls = registry.load(slot, name)
    random = {"untrained": True} if issubclass(cls, NetworkStage) else {}
    assert registry.name_of(cls(**random)) == key


@pytest.mark.parametrize("key", sorted(registry.BUILT_IN))
def test_every_field_of_a_built_in_stage_is_checked(key: str) -> None:
    slot, _, name = key.partition(".")
    cls = registry.load(slot, name)
    for field in dataclasses.fields(cls):
        with pytest.raises(ValueError, match=rf"\b{field.name}\b"):
            cls(**{field.name: object()})


def test_unknown_slot_and_name() -> None:
    with pytest.raises(KeyError, match="the slots are downsample"):
        registry.load("matching", "fpfh")
    known = "cofinet, dense, fcgf, fpfh, geotransformer, given, none, predator, roitr, vgam, vrhcf"
    with pytest.raises(KeyError, match=f"Known: {known}"):
        registry.load("match", "zzz")


def test_a_second_package_plugs_in(tmp_path: Path) -> None:
    wheel = tmp_path / "mine-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as z:
        info = "mine-1.0.dist-info"
        z.writestr("mine.py", PLUGIN)
        z.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
        z.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        # The second line tries to take a built-in's name; a pipeline file must mean the same everywhere.
        z.writestr(
            f"{info}/entry_points.txt", "[hybridreg.stages]\nmatch.mine = mine:Mine\nmatch.fpfh = mine:Mine\n"
        )
        z.writestr(f"{info}/RECORD", "")
    site = tmp_path / "site"
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        str(site),
    ]
    subprocess.run([*pip, str(wheel)], check=True, capture_output=True)
    checked = USE + 'assert registry.load("match", "fpfh").__name__ == "Fpfh"\n'
    done = subprocess.run(
        [sys.executable, "-c", checked],
        cwd=ROOT,
        env={"PYTHONPATH": f"{ROOT}:{site}", "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "plugged in" in done.stdout
