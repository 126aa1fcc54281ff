# SPDX-License-Identifier: MIT
"""The network against the original, output by output, and the pyramid from raw points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from hybridreg.learned.pyramid.grid_subsample import grid_subsample
from hybridreg.learned.pyramid.neighbors import radius_neighbors


@pytest.fixture(scope="module")
def recording(recording_stem: Path):  # type: ignore[no-untyped-def]
    """The recording, read once."""
    from plan import read_recording

    return read_recording(recording_stem)


def test_every_output_agrees(recording) -> None:  # type: ignore[no-untyped-def]
    from compare import differences

    found = differences(recording)
    assert len(found) == 27
    assert {name: value for name, value in found.items() if not value <= 1e-4} == {}


def test_a_changed_weight_is_noticed(recording_stem: Path) -> None:
    from compare import differences
    from plan import read_recording

    spoiled = read_recording(recording_stem)
    with torch.no_grad():
        spoiled.network.in_proj.bias += 0.01
    found = differences(spoiled)
    assert found["out.feats_coarse"] <= 1e-4
    assert found["out.ref_feats_c"] > 1e-4


def test_grids_reproduce_every_stage(recording) -> None:  # type: ignore[no-untyped-def]
    values, plan = recording.values, recording.config.backbone
    clouds = [values["in.ref_points"], values["in.src_points"]]
    for stage in range(1, plan.stages):
        clouds = [grid_subsample(cloud, plan.voxel * 2**stage) for cloud in clouds]
        for cloud, want in zip(clouds, recording.batch.pyramid.clouds(stage), strict=True):
            distance, partner = cKDTree(cloud.numpy()).query(want.numpy())
            assert len(cloud) == len(want)
            assert len(np.unique(partner)) == len(want)
            assert distance.max() < 1e-5


@pytest.mark.parametrize("kind", ["neighbors", "subsampling"])
def test_neighbour_sets_reproduce(recording, kind: str) -> None:  # type: ignore[no-untyped-def]
    pyramid, plan = recording.batch.pyramid, recording.config.backbone
    differing = total = 0
    for stage, want in enumerate(getattr(pyramid, kind)):
        supports = pyramid.clouds(stage)
        queries = pyramid.clouds(stage + (kind == "subsampling"))
        start = offset = 0
        for q, s in zip(queries, supports, strict=True):
            found = radius_neighbors(q, s, plan.radius(stage), plan.neighbor_limits[stage])
            rows = want[start : start + len(q)] - offset
            rows = torch.where(rows < len(s), rows, len(s))
            rows[want[start : start + len(q)] == len(pyramid.points[stage])] = len(s)
            differing += sum(set(a) != set(b) for a, b in zip(found.tolist(), rows.tolist(), strict=True))
            total += len(q)
            start, offset = start + len(q), offset + len(s)
    # Only ties at the limit and float32 distances at the radius may differ.
    assert differing <= 0.001 * total, f"{differing} of {total} neighbour sets differ"
    print(f"{kind}: {differing} of {total} sets differ")


def test_nearest_coarse_point_reproduces(recording) -> None:  # type: ignore[no-untyped-def]
    from hybridreg.learned.pyramid.point_pyramid import build_pyramid

    values, plan = recording.values, recording.config.backbone
    own = build_pyramid(values["in.ref_points"], values["in.src_points"], plan)
    theirs = recording.batch.pyramid
    for stage in range(plan.stages - 1):
        mine = own.points[stage + 1][own.upsampling[stage]]
        recorded = theirs.points[stage + 1][theirs.upsampling[stage]]
        # Our stages are ordered otherwise: compare positions through the nearest point of the recorded stage.
        order = cKDTree(theirs.points[stage].numpy()).query(own.points[stage].numpy())[1]
        assert ((mine - recorded[order]).norm(dim=1) < 1e-4).float().mean() > 0.999
