# SPDX-License-Identifier: MIT
"""Which pairs of many clouds are registered, in rounds, and what their links say together."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting
from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.geometry.extent import reach
from hybridreg.geometry.viewpoint import centre
from hybridreg.many import alignment_words
from hybridreg.many.alignment import Alignment
from hybridreg.many.known_links import checked, judged
from hybridreg.many.links import Link, agrees, all_placed, best_tree, groups, placed
from hybridreg.many.other_ways import elsewhere
from hybridreg.many.overlap_guess import signature, unlike
from hybridreg.many.pose_graph import optimised
from hybridreg.pair import Pair
from hybridreg.pipeline import Pipeline
from hybridreg.runtime.open3d import load_open3d
from hybridreg.runtime.workers import spread

Array = NDArray[np.float64]
Rows = tuple[int, int]
# Rows of two clouds, and the pose that their registration starts from: 16 numbers, None for none.
Key = tuple[int, int, tuple[float, ...] | None]

# Rounds in which groups that nothing joins are tried against each other, each with so many of the likeliest pairs.
_ROUNDS, _LIKELIEST = 4, 3
# Of a cloud that is placed, so many neighbours within this share of the shorter reach confirm it.
_NEIGHBOURS, _NEAR = 3, 0.8
# A doubtful pose may take part, with little weight; one that failed may not.
_TAKES_PART = 0.5


def aligned(
    clouds: Sequence[PointCloud],
    names: tuple[str, ...],
    pipeline: Pipeline,
    *,
    ordered: bool = True,
    known: Mapping[Rows, Any] | None = None,
    reference: int = 0,
    seed: int = 0,
    workers: int | None = None,
    memory: MutableMapping[Key, Link] | None = None,
) -> Alignment:
    """As `register_all`, of checked clouds, two or more.

    Parameters
    ----------
    memory : links that were found before, and where each goes as soon as it is found
        With them the result is the same as without, to the last bit.
    """
    start = time.perf_counter()
    fitting.check_seed(seed)
    if len(clouds) > 2:
        load_open3d()  # before the work, not after it
    memory = {} if memory is None else memory
    held = [cloud.keeping() for cloud in clouds]
    middles = np.array([np.median(cloud.points, axis=0) + cloud.offset for cloud in held])
    given = [checked(rows, T, len(held)) for rows, T in (known or {}).items()]
    about = ((a, b, held[a], held[b], T, pipeline, seed) for a, b, T in given)
    links = list(spread(judged, about, workers, ordered=True, singly=True))
    far = unlike([signature(cloud) for cloud in held])

    def tried() -> set[Rows]:
        return {tuple(sorted((link.source, link.target))) for link in links}  # type: ignore[misc]

    def run(pairs: Iterable[Rows], poses: Array | None = None) -> None:
        new = sorted({tuple(sorted(pair)) for pair in pairs} - tried())
        keys = [_key(a, b, poses) for a, b in new]
        left = [key for key in keys if key not in memory]
        work = ((b, a, held[b], held[a], pipeline, T, seed) for a, b, T in left)
        for key, link in zip(left, spread(_linked, work, workers, ordered=True, singly=True), strict=True):
            memory[key] = link
        links.extend(memory[key] for key in keys)

    n = len(held)
    alike = [(k, int(j)) for k in range(n) for j in np.argsort(far[k])[:2] if j != k]
    run([(k, k + 1) for k in range(n - 1)] if ordered else alike)
    for _ in range(_ROUNDS):
        apart = groups(n, _usable(links))
        if len(apart) == 1:
            break
        run(_across(apart, far, tried()))
    rng = np.random.default_rng([seed, n])
    tree, _ = best_tree(n, _usable(links), middles, rng)
    poses = all_placed(n, tree)
    run((pair for group in groups(n, tree) for pair in _neighbours(held, poses, group, tried())), poses)
    tree, fit = best_tree(n, _usable(links), middles, rng)
    poses = _optimised(n, tree, fit, reference)
    links = [replace(link, role=_role(link, tree, fit, poses, middles)) for link in links]
    found = Alignment(
        names=names,
        poses=poses,
        reference=reference,
        links=tuple(links),
        unsure=tuple(elsewhere(n, tree, fit, middles, reference)),
        reasons=(),
        seconds=time.perf_counter() - start,
    )
    return replace(found, reasons=tuple(alignment_words.reasons(found)))


def _key(a: int, b: int, poses: Array | None) -> Key:
    start = None if poses is None else se3.inverse(poses[a]) @ poses[b]
    return a, b, None if start is None or not np.isfinite(start).all() else tuple(start.ravel().tolist())


def _linked(
    source: int,
    target: int,
    moving: PointCloud,
    still: PointCloud,
    pipeline: Pipeline,
    start: tuple[float, ...] | None,
    seed: int,
) -> Link:
    method = pipeline if start is None else pipeline.swap(prior={"init": np.reshape(start, (4, 4))})
    pair = Pair.of(moving, still, id=f"{source}-{target}")
    try:
        result = method.run(pair, seed=seed)
    except ValueError:  # clouds of which one reaches a hundred times as far, for one
        return Link(
            source=source,
            target=target,
            T_target_source=np.eye(4),
            verdict="failed",
            confidence=0.0,
            metres=0.0,
        )
    return Link(
        source=source,
        target=target,
        T_target_source=result.transformation,
        verdict=result.verdict,
        confidence=result.confidence,
        metres=result.tolerance.metres,
        rivals=result.rivals,
    )


def _usable(links: Sequence[Link]) -> list[Link]:
    return [link for link in links if link.confidence >= _TAKES_PART]


def _across(apart: list[list[int]], far: Array, tried: set[Rows]) -> list[Rows]:
    # From each group but the largest, the likeliest pairs with clouds of any other.
    pairs: list[Rows] = []
    for group in apart[1:]:
        others = [k for other in apart if other is not group for k in other]
        ranked = sorted(
            (far[a, b], a, b) for a in group for b in others if (min(a, b), max(a, b)) not in tried
        )
        pairs += [(a, b) for _, a, b in ranked[:_LIKELIEST]]
    return pairs


def _neighbours(
    held: Sequence[PointCloud], poses: Array, group: Sequence[int], tried: set[Rows]
) -> list[Rows]:
    # Where each cloud of a group was seen from, in its common frame; its nearest others, as long as both see there.
    eyes = np.array(
        [
            se3.apply(poses[k], (centre(held[k].points, held[k].viewpoint) + held[k].offset)[None])[0]
            for k in group
        ]
    )
    sees = np.array([reach(held[k].radii) for k in group])
    pairs: list[Rows] = []
    for here, k in enumerate(group):
        away = np.linalg.norm(eyes - eyes[here], axis=1)
        away[here] = np.inf
        near = [int(j) for j in np.argsort(away) if away[j] < _NEAR * min(sees[here], sees[j])][:_NEIGHBOURS]
        rows = [(k, group[j]) for j in near]
        pairs += [pair for pair in rows if (min(pair), max(pair)) not in tried]
    return pairs


def _optimised(n: int, tree: Sequence[Link], fit: Sequence[Link], reference: int) -> Array:
    # Of the clouds that links join to the reference; the others stay out.
    poses = placed(n, tree, reference)
    rows = np.flatnonzero(np.isfinite(poses[:, 0, 0]))
    row_of = {int(k): place for place, k in enumerate(rows)}
    reached = [link for link in fit if link.source in row_of]

    def in_rows(links: Iterable[Link]) -> list[Link]:
        return [replace(link, source=row_of[link.source], target=row_of[link.target]) for link in links]

    loops = in_rows(link for link in reached if link not in tree)
    if len(rows) > 2 and loops:
        own = in_rows(link for link in reached if link in tree)
        poses[rows] = optimised(poses[rows], own, loops, row_of[reference])
    moved: Array = se3.inverse(poses[reference]) @ poses
    moved[reference] = np.eye(4)  # to the last bit
    return moved


def _role(link: Link, tree: Sequence[Link], fit: Sequence[Link], poses: Array, middles: Array) -> Any:
    if link in tree:
        return "tree"
    if link in fit and (np.isnan(poses[link.source]).any() or agrees(link, poses, middles)):
        return "loop"
    return "contradicts" if link.confidence >= _TAKES_PART else "failed"
