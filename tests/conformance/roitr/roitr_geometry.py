# SPDX-License-Identifier: MIT
"""RoITr's levels, point-pair features and patches against a recording."""

from __future__ import annotations

import torch
from roitr_plan import SIDES, RoitrRecording
from ties import Compared
from torch import Tensor

from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.pyramid.patches import build_patches
from hybridreg.learned.roitr.encoder_decoder import LevelFeatures
from hybridreg.learned.roitr.point_levels import Levels, build_levels

# Metres: neighbours whose distances differ by less stand in either order.
_TIE = 1e-5
# Square metres: the expanded square of float32 coordinates at 15 m has lost this much.
_SQUARE_TIE = 2e-4


def compare_geometry(recording: RoitrRecording, found: Compared) -> None:
    """Levels built from the points alone, features and patches of the recorded levels."""
    values = recording.values
    for side in SIDES:
        given = recording.levels(side)
        own = build_levels(
            values[f"in.{side}_points"].numpy(), values[f"in.{side}_normals"].numpy(), recording.config
        )
        _levels(side, own, given, found)
        ppf = LevelFeatures.of(given)
        for level in range(1, len(given.points) + 1):
            if level > 1:
                found.close(
                    f"out.{side}.points.{level}",
                    given.points[level - 1],
                    values[f"out.{side}.points.{level}"],
                    0.0,
                )
                name = f"out.{side}.down_ppf.{level}"
                found.close(name, ppf.down[level - 2][: len(values[name])], values[name], 1e-4)
            name = f"out.{side}.ppf.{level}"
            found.close(name, ppf.within[level - 1][: len(values[name])], values[name], 1e-4)
        _patches(recording, side, found)


def _levels(side: str, own: Levels, given: Levels, found: Compared) -> None:
    for level in range(1, len(given.points) + 1):
        if level > 1:
            found.same(f"in.{side}.fps.{level}", own.picked[level - 2], given.picked[level - 2])
    if not all(torch.equal(a, b) for a, b in zip(own.points, given.points, strict=True)):
        return  # what follows would only repeat that the picks differ
    for level in range(1, len(given.points) + 1):
        points = given.points[level - 1]
        _rows(
            f"in.{side}.knn.{level}",
            own.neighbors[level - 1],
            given.neighbors[level - 1],
            points,
            points,
            found,
        )
        if level > 1:
            finer = given.points[level - 2]
            _rows(
                f"in.{side}.down_knn.{level}",
                own.down[level - 2],
                given.down[level - 2],
                points,
                finer,
                found,
            )
        if level < len(given.points):
            coarser = given.points[level]
            _rows(f"in.{side}.up_knn.{level}", own.up[level - 1], given.up[level - 1], points, coarser, found)
            found.close(
                f"in.{side}.up_dist.{level}", own.up_distance[level - 1], given.up_distance[level - 1], 1e-5
            )


def _rows(name: str, own: Tensor, given: Tensor, queries: Tensor, supports: Tensor, found: Compared) -> None:
    if own.shape != given.shape:
        found.values[name] = (float("inf"), 0.0)
        return
    distances = [(supports[rows] - queries[:, None]).double().norm(dim=2) for rows in (own, given)]
    found.tied(name, own != given, (distances[0] - distances[1]).abs(), _TIE)


def _patches(recording: RoitrRecording, side: str, found: Compared) -> None:
    values, levels = recording.values, recording.levels(side)
    points, nodes = levels.points[0], levels.points[-1]
    patches = build_patches(points, nodes, recording.config.matching.patch_points)
    squares = squared_distances(points, nodes)
    want = values[f"out.{side}.point_to_node"]
    rows = torch.arange(len(points))
    found.tied(
        f"out.{side}.point_to_node",
        patches.owner != want,
        (squares[rows, patches.owner] - squares[rows, want]).abs(),
        _SQUARE_TIE,
    )
    found.same(f"out.{side}.node_masks", patches.occupied, values[f"out.{side}.node_masks"])
    found.same(f"out.{side}.node_knn_masks", patches.mask, values[f"out.{side}.node_knn_masks"])
    given = values[f"out.{side}.node_knn_indices"]
    if patches.index.shape != given.shape:
        found.values[f"out.{side}.node_knn_indices"] = (float("inf"), 0.0)
        return
    padded = torch.cat([squares, squares.new_full((1, len(nodes)), 1e12)])
    slots = torch.arange(len(nodes))[:, None]
    gaps = (padded[patches.index, slots] - padded[given, slots]).abs()
    found.tied(f"out.{side}.node_knn_indices", patches.index != given, gaps, _SQUARE_TIE)
