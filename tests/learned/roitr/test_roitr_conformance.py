# SPDX-License-Identifier: MIT
"""RoITr against the recording of the original."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hybridreg.learned.roitr.batch import oriented_normals


@pytest.fixture(scope="module")
def stem(recording_stem: Path) -> Path:
    """The recording, or a skip where it is absent."""
    found = recording_stem.with_name("roitr_mini")
    if not found.with_name("roitr_mini.json").is_file():
        pytest.skip("no recording of RoITr beside this checkout")
    return found


def test_every_output_agrees(stem: Path) -> None:
    from run import main

    assert main([str(stem)]) == 0


@pytest.mark.parametrize(
    ("name", "hurt"),
    [
        ("w.backbone.enc2.0.transformer.transformer.attention.proj_vp.weight", "out.src.enc_down.2"),
        (
            "w.backbone.global_transformer.transformer.layers.0.attention.pos_norm.bias",
            "out.tgt.global.position.0",
        ),
        ("w.optimal_transport.alpha", "out.matching_scores_first4"),
    ],
)
def test_a_changed_weight_is_noticed(stem: Path, tmp_path: Path, name: str, hurt: str) -> None:
    from recorded_roitr import compare

    for end in (".json", ".npz"):
        shutil.copy(stem.with_name(f"{stem.name}{end}"), tmp_path / f"changed{end}")
    weights = dict(np.load(stem.with_name(f"{stem.name}_weights.npz")))
    weights[name] = weights[name] + np.float32(0.05)
    np.savez(tmp_path / "changed_weights.npz", **weights)
    failed = {key for key, (value, bound) in compare(tmp_path / "changed").items() if not value <= bound}
    assert hurt in failed
    assert "out.src.ppf.1" not in failed


def test_our_normals_are_the_recorded_ones(stem: Path) -> None:
    values = np.load(stem.with_name(f"{stem.name}.npz"))
    points, want = values["in.src_points"].astype(np.float64), values["in.src_normals"]
    found = oriented_normals(points, np.zeros(3), 33)
    # Another library's eigenvectors; where a neighbourhood is a ball, any direction is the least spread one.
    assert np.mean(np.sum(found * want, axis=1) > 0.999) > 0.99
