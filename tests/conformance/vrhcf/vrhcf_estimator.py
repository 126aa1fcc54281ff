# SPDX-License-Identifier: MIT
"""HCF against a recording, step by step, each step on the recorded outcome of the one before."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from ties import Compared
from torch import Tensor

from hybridreg.classical.hcf.compatibility import first_order, leading_eigenvectors, pick_seeds, second_order
from hybridreg.classical.hcf.consensus_sets import filter_sets, first_sets, set_poses, set_weights
from hybridreg.classical.hcf.hcf import Hcf
from hybridreg.geometry import se3

TOLERANCE = 1e-4


def stage_of(part: str, plan: dict[str, Any]) -> Hcf:
    """Our estimator of a recorded plan's part."""
    given, refinement = plan[part], plan["refinement"]
    indoor = given["inlier_threshold"] == 0.10
    return Hcf(
        max_distance=given["inlier_threshold"],
        reach=given["d_thre"],
        nms_radius=given["nms_radius"],
        refine_distance=refinement[
            "threshold_if_inlier_threshold_is_0_10" if indoor else "threshold_otherwise"
        ],
        refine_steps=refinement["iterations"],
        seed_share=given["ratio"],
        set_size=given["k"],
        kept_share=given["filter_ratio"],
        final_size=given["final_k"],
        iterations=given["num_iterations"],
        max_matches=given["max_points"],
    )


def compare_estimator(part: str, plan: dict[str, Any], values: dict[str, Tensor], found: Compared) -> None:
    """Every recorded output of one part (``hcf``, ``hcf_indoor``, ``hcf_small``)."""
    stage = stage_of(part, plan)
    source, target = (values[f"{part}.in.{side}"].double().numpy() for side in ("src", "tgt"))
    source, target = source[: stage.max_matches], target[: stage.max_matches]

    def close(name: str, value: np.ndarray, tolerance: float = TOLERANCE) -> None:
        for key in [
            key for key in values if key == f"{part}.out.{name}" or key.startswith(f"{part}.out.{name}_first")
        ]:
            want = values[key].double()
            own = torch.from_numpy(np.asarray(value, dtype=np.float64))
            found.close(key, own[: len(want)] if want.dim() else own, want, tolerance)

    def recorded(name: str, own: np.ndarray) -> np.ndarray:
        key = f"{part}.out.{name}"
        return values[key].numpy() if key in values else own

    soft = first_order(source, target, stage.reach or 0.0)
    close("sc_measure", soft)
    vectors, first_count = leading_eigenvectors(soft[None], stage.iterations)
    close("leading_eigenvector", vectors[0])
    confidence = recorded("leading_eigenvector", vectors[0])
    count = int(len(source) * stage.seed_share)
    seeds = pick_seeds(source, confidence, stage.nms_radius or 0.0, count)
    close("local_maxima", seeds.is_peak, 0.0)
    close("seeds", seeds.rows, 0.0)
    close("seeds_above_zero", ((confidence * seeds.is_peak)[seeds.rows] > 0).sum(), 0.0)
    agreement = second_order(soft, recorded("seeds", seeds.rows))
    close("sc2", agreement, 0.0)
    sets = first_sets(agreement, stage.set_size)
    close("stage0_sets", sets, 0.0)
    sets = recorded("stage0_sets", sets)
    steps = filter_sets(soft, sets, stage.kept_share, stage.final_size)
    for number, step in enumerate(steps, start=1):
        close(f"stage{number}_sets", step.sets, 0.0)
        close(f"stage{number}_scores", step.scores, 0.0)
        sets = recorded(f"stage{number}_sets", step.sets)
    weights, second_count = set_weights(soft, sets, stage.iterations)
    close("final_weights", weights)
    close("power_iterations", np.array([first_count, second_count]), 0.0)
    _poses(part, source, target, sets, recorded("final_weights", weights), values, found)
    _winner(part, stage, source, target, values, found, close)


def _poses(part, source, target, sets, weights, values, found) -> None:  # type: ignore[no-untyped-def]
    key = f"{part}.out.seed_transforms"
    if key not in values:
        return
    own, want = set_poses(source, target, sets, weights), values[key].double().numpy()
    apart = np.abs(own - want).max(axis=(1, 2))
    # Members that lie on a line, or of which two alone weigh anything, leave the turn about it to rounding: there
    # both poses must fit the set equally well instead.
    loose = _spread(source[sets], weights) < 1e-3
    residual = [_misfit(T, source[sets], target[sets], weights) for T in (own, want)]
    apart[loose] = np.abs(residual[0] - residual[1])[loose]
    if loose.any():
        found.ties[key] = int(loose.sum())
    # A motion of a small set far from the origin: rounding of the turn times the distance, float32 in the original.
    reach = np.abs(source).max()
    found.values[key] = (float(apart.max()), TOLERANCE * max(1.0, reach))


def _spread(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Second singular value of the weighted points over the first: 0 on a line."""
    w = weights / np.maximum(weights.sum(1, keepdims=True), 1e-12)
    centred = (points - (points * w[..., None]).sum(1, keepdims=True)) * np.sqrt(w)[..., None]
    values = np.linalg.svd(centred, compute_uv=False)
    return values[:, 1] / np.maximum(values[:, 0], 1e-12)


def _misfit(T: np.ndarray, source: np.ndarray, target: np.ndarray, weights: np.ndarray) -> np.ndarray:
    moved = np.einsum("sij,skj->ski", T[:, :3, :3], source) + T[:, None, :3, 3]
    return np.sqrt((weights * ((moved - target) ** 2).sum(2)).sum(1))


def _winner(part, stage, source, target, values, found, close) -> None:  # type: ignore[no-untyped-def]
    whole = stage.poses(source, target, stage.max_distance)
    key = f"{part}.out.seed_transforms"
    given = values[key].double().numpy() if key in values else whole
    counts = _counts(given, source, target, stage.max_distance)
    want = values[f"{part}.out.seed_inliers"].numpy()
    if key in values:
        close("seed_inliers", counts, 0.0)
    else:
        # From our own poses: a residual at the threshold may fall on either side, and loose sets have loose poses.
        differing = counts != want
        if differing.any():
            found.ties[f"{part}.out.seed_inliers"] = int(differing.sum())
        allowed = np.maximum(2, 0.05 * want.max())
        found.values[f"{part}.out.seed_inliers"] = (float(np.abs(counts - want).max()), float(allowed))
    best = int(counts.argmax())
    close("best_seed", np.array(best), 0.0)
    close("coarse_transform", given[best])
    coarse = values[f"{part}.out.coarse_transform"].double().numpy()
    steps = stage.refinement(source, target, coarse, stage.refine_distance)
    close("refine_counts", np.array([count for count, _ in steps]), 0.0)
    close("refine_transforms", np.array([T for _, T in steps]))
    T = steps[-1][1] if steps else coarse
    close("transform", T)
    close("labels", np.linalg.norm(se3.apply(T, source) - target, axis=1) < stage.max_distance, 0.0)
    # And all of it in one go, from the matches to the pose.
    own = stage.refined(
        source,
        target,
        whole[int(_counts(whole, source, target, stage.max_distance).argmax())],
        stage.refine_distance,
    )
    want = values[f"{part}.out.transform"].double().numpy()
    found.values[f"{part}.out.transform (chain)"] = (float(np.abs(own - want).max()), TOLERANCE)


def _counts(poses: np.ndarray, source: np.ndarray, target: np.ndarray, near: float) -> np.ndarray:
    return np.array([(np.linalg.norm(se3.apply(T, source) - target, axis=1) < near).sum() for T in poses])
