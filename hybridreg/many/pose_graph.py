# SPDX-License-Identifier: MIT
"""The poses that fit all links best, by Open3D's global optimisation (Choi, Zhou, Koltun 2015: its line process)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.many.links import Link
from hybridreg.runtime.open3d import load_open3d

Array = NDArray[np.float64]

# Weight of a certain link: Open3D takes the last entry of a link's information for its count of points, and weighs its
# line process by it. Metres at which a turn moves what is seen, which makes turns comparable to translations.
_POINTS, _ARM = 100.0, 10.0


def optimised(poses: Array, tree: Sequence[Link], loops: Sequence[Link], reference: int) -> Array:
    """Poses (n, 4, 4) after optimisation.

    Parameters
    ----------
    poses : (n, 4, 4)
        Where the tree puts the clouds, each to the reference; all finite.
    tree, loops : links that are held to be right, and those that may be dropped; in rows of `poses`
    reference : row that stays

    Raises
    ------
    ImportError
        Without open3d.
    """
    registration = load_open3d().pipelines.registration
    graph = registration.PoseGraph()
    for pose in poses:
        graph.nodes.append(registration.PoseGraphNode(pose))
    for link in (*tree, *loops):
        weight = _POINTS * max(link.confidence, 0.01)
        information = np.diag(np.repeat([weight * _ARM**2, weight], 3))
        edge = registration.PoseGraphEdge(
            link.source, link.target, link.T_target_source, information, uncertain=link in loops
        )
        graph.edges.append(edge)
    farthest = max((link.metres for link in loops), default=0.5)
    # By name, as other keywords change this one's default; the reference, or the first cloud moves.
    option = registration.GlobalOptimizationOption(
        max_correspondence_distance=farthest, edge_prune_threshold=0.25, reference_node=reference
    )
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        option,
    )
    found = np.array([np.asarray(node.pose) for node in graph.nodes])
    found = se3.inverse(found[reference]) @ poses[reference] @ found if len(found) else found
    for pose in found:
        pose[:3, :3] = se3.project(pose[:3, :3])
    return found
