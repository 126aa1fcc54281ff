# SPDX-License-Identifier: MIT
"""What a caller knows of a pose before it is searched for, and how that prepares a pair."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.candidates.candidates import Candidates
from hybridreg.geometry import se3
from hybridreg.geometry.placement import Placement
from hybridreg.geometry.pose_bounds import PoseBounds
from hybridreg.io.poses.pose_file import read_pose
from hybridreg.pair import Pair
from hybridreg.prior import placing, size_search
from hybridreg.spec import from_table

Array = NDArray[np.float64]
# A start is often written down with two digits: a rotation whose R R^T is off by less is meant as one.
_ROUNDED = 0.03
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class Prior:
    """What is known of a pose; every part narrows the search, and poses beyond are no rivals for the verdict.

    Parameters
    ----------
    init : (4, 4), path of a pose in any form that `result.format` writes, in .npy or .json, or None
        A rough pose, source to target, in the coordinates of both clouds. Searched around first.
    max_translation : float or None
        Metres that the middle of the source may lie away from where `init` (or nothing) puts it. A start that is turned
        by some degrees moves a middle that lies far from the source's origin, and that counts.
    max_rotation : float or None
        Degrees that the pose may turn away from `init` (or from none).
    gravity : "known", "unknown", "up", (3,), or two of these vectors
        "known" and "unknown" as for `Pair`. "up": z points up in both clouds, as a levelled scanner's or a map's. A
        vector along the vertical where it is another axis, the same way in both clouds (up in both, or down in both);
        or one for the source and one for the target.
    crop : float, six numbers, mapping of "source" and "target" to such, or None
        What of the clouds counts. Six numbers are a box, `x, y, z` of its lowest corner, then of its highest one, in
        the cloud's own coordinates; a bare box is the target's. A number keeps what of the target lies so many metres
        (seen from above) from where `init` puts the middle of the source.
    scale : bool
        The source's size is not known (photogrammetry, another unit): it is estimated first.

    Raises
    ------
    ValueError
        A value that is none of these, by name.
    """

    init: Any = None
    max_translation: float | None = None
    max_rotation: float | None = None
    gravity: Any = "known"
    crop: Any = field(default=None, hash=False)  # a mapping, which has no hash
    scale: bool = False

    def __post_init__(self) -> None:
        init = read_pose(self.init) if isinstance(self.init, (str, os.PathLike)) else self.init
        if init is not None:
            # Nested tuples, so that two of them can be compared and written to TOML.
            object.__setattr__(self, "init", _nested(se3.rounded(init, "init", _ROUNDED)))
        for name in ("max_translation", "max_rotation"):
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and value > 0.0):
                raise ValueError(f"{name}={value!r} must be a positive number, or left out")
        object.__setattr__(self, "gravity", _gravity(self.gravity))
        object.__setattr__(self, "crop", _crop(self.crop))
        if not isinstance(self.scale, bool):
            raise ValueError(f"scale={self.scale!r} must be True or False; True estimates it")

    @classmethod
    def of(cls, value: Any) -> Prior:
        """Of a table of its fields, or a Prior as it is; None is an empty one."""
        if isinstance(value, Prior):
            return value
        table = {} if value is None else value
        known = [each.name for each in fields(cls)]
        if not isinstance(table, Mapping) or set(table) - set(known):
            raise ValueError(f"prior={value!r}: expected a table of some of {', '.join(known)}")
        return cls(**table)

    def to_table(self) -> dict[str, Any]:
        """What differs from an empty prior, as TOML holds it."""
        return {
            each.name: _listed(getattr(self, each.name))
            for each in fields(self)
            if getattr(self, each.name) != each.default
        }

    def applied(self, pair: Pair) -> Pair:
        """The pair cut, sized and moved to its start, with the bounds of its pose.

        Raises
        ------
        ValueError
            A region that holds too few points.
        """
        start = np.eye(4) if self.init is None else np.array(self.init)
        source, target = pair.source, pair.target
        crop = self.crop or {}
        if "source" in crop:
            source = placing.within_box(source, np.array(crop["source"]), "source")
        if "target" in crop:
            target = placing.within_box(target, np.array(crop["target"]), "target")
        if "radius" in crop:
            middle = se3.apply(start, (np.median(source.points, axis=0) + source.offset)[None])[0]
            target = placing.within_radius(target, middle, crop["radius"], "target")
        size = size_search.found(pair.with_clouds(source, target)) if self.scale else size_search.Size()
        source = placing.sized(source, size.scale)
        arm = float(np.linalg.norm(np.median(source.points, axis=0) + source.offset))
        up_source, up_target = self._verticals()
        level = _levelling(up_target)
        T_placed_source = level @ start
        if self.init is None:
            T_placed_source = _levelling(up_source)
        source, target = placing.moved(source, T_placed_source), placing.moved(target, level)
        centre = np.median(source.points, axis=0)
        bounds = PoseBounds(
            centre=centre,
            start=centre + source.offset - target.offset,
            max_translation=self.max_translation,
            max_rotation=self.max_rotation,
            arm=arm,
            up_source=None if up_source is None else T_placed_source[:3, :3] @ up_source,
            up_target=None if up_target is None else level[:3, :3] @ up_target,
        )
        return pair.replaced(
            source=source,
            target=target,
            gravity="unknown" if self.gravity == "unknown" else pair.gravity,
            placed=Placement(T_placed_source, level, *size),
            bounds=bounds,
        )

    def started(self, estimate: Any) -> Any:
        """The estimate stage; of several entries (`Candidates`) the start itself is the first, where there is one."""
        if self.init is None or not isinstance(estimate, Candidates):
            return estimate
        return estimate.replace(of=({"estimate": from_table("identity", "estimate")}, *estimate.of))

    def _verticals(self) -> tuple[Array | None, Array | None]:
        if self.gravity in ("known", "unknown"):
            return None, None
        if self.gravity == "up":
            return _Z, _Z
        both = np.array(self.gravity)
        up_source, up_target = both if both.ndim == 2 else (both, both)
        # Which way a vector points along the vertical does not matter, as long as both do the same.
        sign = 1.0 if up_target[2] >= 0.0 else -1.0
        return sign * up_source, sign * up_target


def _levelling(up: Array | None) -> Array:
    return se3.from_rt(np.eye(3) if up is None else se3.turn_to_z(up), np.zeros(3))


def _gravity(value: Any) -> Any:
    if isinstance(value, str) and value in ("known", "unknown", "up"):
        return value
    problem = (
        f'gravity={value!r} must be "known", "unknown", "up", a vector of three numbers along the vertical, or two '
        "such vectors, of the source and of the target"
    )
    try:
        vectors = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(problem) from None
    if vectors.shape not in ((3,), (2, 3)) or not np.isfinite(vectors).all():
        raise ValueError(problem)
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if not (lengths > 0.0).all():
        raise ValueError(problem)
    return _nested(vectors / lengths)


def _crop(value: Any) -> dict[str, Any] | None:
    if value is None:
        return None
    problem = (
        f"crop={value!r} must be a radius in metres, a box of the target as six numbers (lowest x, y, z, then "
        'highest), or a mapping of "source" and "target" to such boxes'
    )
    if _is_number(value):
        if not value > 0.0:
            raise ValueError(problem)
        return {"radius": float(value)}
    table = value if isinstance(value, Mapping) else {"target": value}
    crop: dict[str, Any] = {}
    for side, given in table.items():
        if side == "radius" and _is_number(given) and given > 0.0:
            crop[side] = float(given)
            continue
        try:
            box = np.array(given, dtype=np.float64).reshape(2, 3)
        except (TypeError, ValueError):
            raise ValueError(problem) from None
        if side not in ("source", "target") or np.isnan(box).any() or not (box[0] < box[1]).all():
            raise ValueError(problem)
        crop[side] = _nested(box.ravel())
    return crop or None


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float, np.number))
        and not isinstance(value, bool)
        and bool(np.isfinite(value))
    )


def _nested(array: Array) -> Any:
    return tuple(map(_nested, array)) if np.ndim(array) else float(array)


def _listed(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_listed(each) for each in value]
    return {key: _listed(each) for key, each in value.items()} if isinstance(value, dict) else value
