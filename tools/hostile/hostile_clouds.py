# SPDX-License-Identifier: MIT
"""Arrays of every shape, dtype, scale and owner, into pipelines."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from hybridreg import Pipeline, register
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.result import RegistrationResult
from tools.hostile.containers import CONTAINERS, TAKEN, contain
from tools.hostile.shapes import SHAPES, SPOILS, shape, spoil

SCALES = (1e-3, 1e3, 1e-12, 1e-160, 1e6, 1e12, 1e100, 1e300)
OFFSETS = (50.0, 1e4, 5e5, 1e8, 1e10, 1e14)
VOXELS = (None, None, None, None, None, None, 0.3, 0.3, 1.0, 1e-9, 1e9)

# By slot; "default" stands for the preset. Cheap ones first and more often.
PIPELINES: tuple[Any, ...] = (
    {"match": "none", "estimate": "identity", "refine": "none"},
    {"match": "none", "estimate": "identity", "refine": "icp"},
    {"match": "none", "estimate": "identity", "refine": {"stage": "icp", "kind": "plane"}},
    {"match": "none", "estimate": "identity", "refine": "gicp"},
    {"match": "none", "estimate": "identity", "refine": "kiss-icp"},
    {"downsample": "none", "match": "none", "estimate": "identity", "refine": "icp"},
    {"downsample": {"stage": "random", "n_points": 100}, "match": "fpfh", "estimate": "svd", "refine": "none"},
    {"downsample": {"stage": "voxel", "density": "match"}, "match": "fpfh", "estimate": "svd", "refine": "gicp"},
    {"match": "fpfh", "estimate": {"stage": "ransac", "iterations": 2000}, "refine": "none"},
    {"match": "fpfh", "estimate": "fgr", "refine": "none"},
    {"overlap": "visibility", "match": "fpfh", "estimate": "svd", "refine": "none"},
    {"match": "none", "estimate": "kiss", "refine": "none"},
    {"match": "none", "estimate": "birdseye", "refine": "none"},
    {"match": {"stage": "geotransformer", "untrained": True}, "estimate": "lgr", "refine": "none"},
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """How to make one cloud; smaller than the points themselves."""

    shape: str
    n: int
    seed: int
    scale: float = 1.0
    offset: float = 0.0
    spoils: tuple[str, ...] = ()
    container: str = "float64"

    def points(self) -> NDArray[np.float64]:
        """(n, 3), before it is put into a container."""
        points = shape(self.shape, self.n, self.seed)
        for name in self.spoils:
            points = spoil(points, name, self.seed)
        with np.errstate(over="ignore"):
            return points * self.scale + self.offset

    def make(self) -> Any:
        """What the user passes."""
        return contain(self.points(), self.container)


@dataclass(frozen=True, kw_only=True)
class ArrayCase:
    """Two clouds, the target perhaps the moved source, and a pipeline."""

    kind: ClassVar[str] = "arrays"
    allowed: ClassVar[tuple[type[BaseException], ...]] = (ValueError,)

    source: Cloud
    target: Cloud | None  # None: the source, turned about z and shifted
    pipeline: Any
    voxel: float | None = None
    nonfinite: Literal["raise", "drop"] = "raise"
    seed: int = 0

    def run(self) -> str:
        """Register, and check what the result promises."""
        source = self.source.make()
        target = moved(self.source) if self.target is None else self.target.make()
        if self.pipeline == "default":
            result = register(source, target, voxel=self.voxel, nonfinite=self.nonfinite, seed=self.seed)
        else:
            pair = Pair.of(source, target, nonfinite=self.nonfinite)
            gridded = self.pipeline.get("downsample") is None  # other stages have no voxel
            voxel = self.voxel if gridded else None
            result = Pipeline(voxel=voxel, **self.pipeline).run(pair, seed=self.seed)
        check(result)
        return result.verdict


def moved(cloud: Cloud) -> Any:
    """A cloud rotated and shifted, in its own container where that still holds the points."""
    T = se3.yaw(40.0)
    T[:3, 3] = 0.5, -0.25, 0.1
    with np.errstate(over="ignore", invalid="ignore"):
        points = se3.apply(T, cloud.points() - cloud.offset) + cloud.offset
    return contain(points, cloud.container)


def check(result: RegistrationResult) -> None:
    """What every result promises, whatever the clouds."""
    T = result.transformation
    assert T.shape == (4, 4), T.shape
    assert np.isfinite(T).all(), T
    assert np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < 1e-9, T
    assert np.linalg.det(T[:3, :3]) > 0.0, T
    assert result.verdict in ("ok", "doubtful", "failed"), result.verdict
    assert 0.0 <= result.confidence <= 1.0, result.confidence
    assert result.reasons, "no reason given"
    assert 0.0 <= result.fitness <= 1.0, result.fitness
    json.loads(result.to_json())


@st.composite
def clouds(draw: st.DrawFn, most: int = 2) -> Cloud:
    """Ordinary clouds with up to `most` oddities: more would all be refused because of the first."""
    fields: dict[str, Any] = {
        "shape": draw(st.sampled_from(SHAPES)),
        "n": draw(st.sampled_from((60, 300, 300, 1000, 3000))),
        "seed": draw(st.integers(0, 2**31)),
    }
    return Cloud(**{**fields, **dict(draw(st.lists(st.one_of(*_ODDITIES), max_size=2)))})


_ODDITIES: tuple[st.SearchStrategy[tuple[str, Any]], ...] = tuple(
    st.tuples(st.just(field), st.sampled_from(values))
    for field, values in (
        ("n", (0, 1, 3, 19, 20, 21)),
        ("scale", SCALES),
        ("offset", OFFSETS),
        ("spoils", tuple((name,) for name in SPOILS)),
        ("container", CONTAINERS),
        ("container", TAKEN),
        ("container", TAKEN),
    )
)


def cases(*, default: bool) -> st.SearchStrategy[ArrayCase]:
    """Pairs for the cheap pipelines, or for the preset `default`."""
    return st.builds(
        ArrayCase,
        source=clouds(most=1 if default else 2),
        target=st.one_of(st.none(), clouds(most=1)),
        pipeline=st.just("default") if default else st.sampled_from(PIPELINES),
        voxel=st.sampled_from(VOXELS),
        nonfinite=st.sampled_from(("raise", "drop")),
        seed=st.integers(0, 2**32 - 1),
    )
