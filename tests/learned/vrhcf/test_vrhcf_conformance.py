# SPDX-License-Identifier: MIT
"""SphereNet and HCF against the recording of the original."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="module")
def stem(recording_stem: Path) -> Path:
    """The recording, or a skip where it is absent."""
    found = recording_stem.with_name("vrhcf_mini")
    if not found.with_name("vrhcf_mini.json").is_file():
        pytest.skip("no recording of VRHCF beside this checkout")
    return found


def test_every_output_agrees(stem: Path) -> None:
    from run import main

    assert main([str(stem)]) == 0


def test_what_is_altered_is_noticed(stem: Path, tmp_path: Path) -> None:
    from recorded_vrhcf import compare

    # A part of the patches tells as much; what hangs on all of them is left out.
    values = dict(np.load(stem.with_name(f"{stem.name}.npz")))
    values = {
        n: a[:40] if a.shape[:1] == (256,) else a
        for n, a in values.items()
        if "first64" not in n or "hcf" in n
    }
    np.savez(tmp_path / "changed.npz", **{n: a for n, a in values.items() if not n.startswith("match.")})
    weights = dict(np.load(stem.with_name(f"{stem.name}_weights.npz")))
    weights["w.conv_net.ops.21.weight"] = weights["w.conv_net.ops.21.weight"] + np.float32(0.01)
    np.savez(tmp_path / "changed_weights.npz", **weights)
    text = stem.with_name(f"{stem.name}.json").read_text()
    assert '"threshold_otherwise": 1.2' in text
    changed = text.replace('"threshold_otherwise": 1.2', '"threshold_otherwise": 0.1')
    (tmp_path / "changed.json").write_text(changed)
    failed = {key for key, (value, bound) in compare(tmp_path / "changed").items() if not value <= bound}
    assert {"out.src.descriptors", "out.src.conv7_first1", "hcf.out.transform"} <= failed
    assert not failed & {
        "out.src.voxels_first16",
        "out.src.conv6_first1",
        "hcf.out.seeds",
        "hcf_indoor.out.transform",
    }
