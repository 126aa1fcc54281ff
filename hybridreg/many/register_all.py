# SPDX-License-Identifier: MIT
"""Many clouds into one frame: pairs by a guess of their overlap, verdicts as weights, a pose graph over what agrees."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from hybridreg.cloud import PointCloud
from hybridreg.many.alignment import Alignment
from hybridreg.many.known_links import is_row
from hybridreg.many.link_search import Rows, aligned
from hybridreg.pipeline import Pipeline
from hybridreg.presets import DEFAULT


def register_all(
    clouds: Sequence[Any],
    *,
    names: Sequence[str] | None = None,
    ordered: bool = True,
    known: Mapping[Rows, Any] | None = None,
    reference: int = 0,
    preset: str = DEFAULT,
    pipeline: Pipeline | None = None,
    voxel: float | None = None,
    seed: int = 0,
    nonfinite: Literal["raise", "drop"] = "raise",
    workers: int | None = None,
) -> Alignment:
    """Put many clouds into the frame of one of them.

    Neighbours in the sequence (or clouds that look alike) are registered first; groups that nothing joins are tried
    against each other; then each cloud against neighbours that the first poses show, so that every pose is confirmed by
    circles. The spanning tree with which the most links agree is taken, links that contradict it are left out and told
    by name, and Open3D's global optimisation spreads what is left of the error.

    Parameters
    ----------
    clouds : sequence of anything that `PointCloud.of` takes, two or more
    names : what they are called; the paths, or `cloud 0` and so on
    ordered : whether neighbours in the sequence were taken near each other, as along a drive
    known : mapping of (row of source, row of target) to (4, 4), or None
        Poses that you have from elsewhere, by odometry or satellites. Each pair is registered from there, within four
        tolerances (2 m and 8 degrees for vehicles), and without it where that is not "ok"; a pose that the clouds
        neither confirm nor contradict is taken as it is, and leaves the whole "doubtful".
    reference : row of the cloud whose frame all others get
    preset, voxel : as for `register`
    pipeline : instead of a preset
    nonfinite : as for `register`
    workers : processes; None takes what `joblib.parallel_config` says (a dask cluster, for one), else 1

    Raises
    ------
    ValueError
        Fewer than two clouds, a row that does not exist, a pose that is none, a pipeline with a voxel besides; or a
        cloud that no pose can be computed from, by its name.
    ImportError
        Without open3d, of more than two clouds.
    """
    if pipeline is not None and voxel is not None:
        raise ValueError(
            f"voxel={voxel} is a preset's; give the pipeline its own: pipeline.swap(voxel={voxel})"
        )
    if pipeline is not None and preset != DEFAULT:
        raise ValueError(f"preset={preset!r} and a pipeline: give one of them")
    clouds = _listed(clouds)
    told = _names(clouds, names)
    if not is_row(reference, len(clouds)):
        raise ValueError(
            f"reference={reference!r} must be a row of the {len(clouds)} clouds, 0 to {len(clouds) - 1}"
        )
    held = [
        PointCloud.of(cloud, name=name, nonfinite=nonfinite) for cloud, name in zip(clouds, told, strict=True)
    ]
    method = Pipeline.preset(preset, voxel=voxel) if pipeline is None else pipeline
    return aligned(
        held, told, method, ordered=ordered, known=known, reference=reference, seed=seed, workers=workers
    )


def _listed(clouds: Any) -> list[Any]:
    if isinstance(clouds, Mapping):
        raise ValueError(
            "clouds: expected a list; give clouds=list(x.values()) and names=list(x) of your mapping x"
        )
    if isinstance(clouds, (str, os.PathLike)):
        raise ValueError(
            f"clouds: {os.fspath(clouds)!r} is one path, two or more are needed; give a list of them"
        )
    if getattr(clouds, "ndim", 3) == 2:
        raise ValueError(
            f"clouds: one array of shape {tuple(clouds.shape)}; give a list of two clouds or more"
        )
    return list(clouds)


def _names(clouds: Sequence[Any], names: Sequence[str] | None) -> tuple[str, ...]:
    if len(clouds) < 2:
        raise ValueError(f"clouds: {len(clouds)} given, two or more are needed")
    if names is None:
        return tuple(
            os.fspath(cloud) if isinstance(cloud, (str, os.PathLike)) else f"cloud {k}"
            for k, cloud in enumerate(clouds)
        )
    if len(names) != len(clouds) or len(set(names)) != len(names):
        raise ValueError(f"names: {len(names)} given for {len(clouds)} clouds; each needs one of its own")
    return tuple(names)
