# SPDX-License-Identifier: MIT
"""The checks that a cloud must pass before any stage sees it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.meaning.far_plane import far_plane
from hybridreg.io.meaning.farthest_shell import farthest_shell
from hybridreg.io.meaning.no_coordinate import no_coordinate
from hybridreg.io.meaning.shared_place import shared_place, shared_places
from hybridreg.io.point_objects import points_of

Array = NDArray[np.float64]

MIN_POINTS = 20
# Beyond this (the distance to the sun, in metres) squares of coordinates lose all meaning.
_LARGEST = 1.5e11
# A cloud thinner than a millionth of its length in two directions fixes no rotation about that length.
_THINNEST = 1e-6
# The cure that only a caller has whose function takes the argument.
OR_DROP = ' or pass nonfinite="drop"'
_LOT = 2**18  # points
_LACKED = "hybridreg_asks_for_what_nothing_has"
_FILLED = 0.01  # share of points exactly at one place from which they count as missing returns
# Heights that rasters write for cells without data, 1,000,000 of them BAG; other points must be far from them.
_NO_HEIGHT = frozenset(
    s * h for h in (999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0, 1e6) for s in (-1.0, 1.0)
)
_COARSE = 0.01  # metres between coordinates from which their rounding is reported
_TINY = 1e-12  # metres, for the logarithm of zero
_WHOLE = 1e-6  # of a digit, off by which a decimal number in double precision may be
_LOOKED_AT = 2_000  # points whose rounding is checked


def coordinates(x: Any, name: str) -> Array:
    """Take (N, 3) float64 coordinates out of any object that holds points."""
    try:
        return points_of(x, name)
    except (ValueError, MemoryError) as error:
        if str(error).startswith(f"{name}: "):
            raise
        raise _unreadable(x, name, error) from error
    except Exception as error:  # a third-party object may raise anything
        raise _unreadable(x, name, error) from error


def answering(x: Any, name: str) -> Any:
    """`x`, to be asked for attributes; a plain dictionary of one whose attributes are its entries, as configurations of
    networks have them.

    Raises
    ------
    ValueError
        It is no dictionary, and raises another error than AttributeError for what it lacks, as pylas 0.4.3's clouds do.
    """
    try:
        hasattr(x, _LACKED)
    except Exception as error:  # KeyError of `__getattr__ = dict.__getitem__`, ValueError of pylas
        if isinstance(x, Mapping):
            return dict(x)
        kind = f"{type(x).__module__}.{type(x).__name__}"
        raise ValueError(
            f"{name}: cannot read points from {kind}: it raises {type(error).__name__}, not AttributeError, for an "
            "attribute that it lacks; pass its coordinates in metres, such as numpy.column_stack([x.x, x.y, x.z])"
        ) from error
    return x


def _unreadable(x: Any, name: str, error: Exception) -> ValueError:
    return ValueError(
        f"{name}: cannot read points from {type(x).__name__}: {error}; pass an array of shape (N, 3), such as "
        "numpy.column_stack([x, y, z])"
    )


def finite(points: Array, name: str, *, drop: bool) -> tuple[Array, NDArray[np.bool_] | None]:
    """Refuse rows with a NaN or an infinity, or drop them on request; returns which rows (N,) remain, None for all."""
    every = np.isfinite(points)
    if every.all():
        return points, None
    good: NDArray[np.bool_] = np.asarray(every.all(axis=1))
    n_bad = len(points) - int(good.sum())
    if not drop:
        raise ValueError(
            f"{name}: {n_bad} of {len(points)} points are not finite (the first is row {int(np.argmin(good))}); "
            f"remove them{OR_DROP}"
        )
    return points[good], good


def returned(
    points: Array, rows: NDArray[np.bool_] | None, name: str, *, drop: bool
) -> tuple[Array, NDArray[np.bool_] | None]:
    """Warn of many points exactly at (0, 0, 0), which drivers write for missing returns, or at another place, of a
    sphere of rays that met nothing, and of heights that rasters write for cells without data, or drop them on request.

    `rows` (N,) are those that `finite` kept; the result is of the same form.
    """
    points, rows = _measured(points, rows, name, drop=drop)
    points, rows = _away_from(
        np.zeros(3), "which drivers write for missing returns", points, rows, name, drop=drop
    )
    points, rows = _met(points, rows, name, drop=drop)
    place = shared_place(points)
    if place is not None:
        why = "as missing returns do that were moved with the others, and padding does"
        points, rows = _away_from(place, why, points, rows, name, drop=drop)
    there = shared_places(points)
    if there is None:
        return points, rows
    problem = "share their places, four and more at each, as missing returns do that were moved with a moving sensor"
    return _without(there, problem, points, rows, name, drop=drop)


def _without(
    there: NDArray[np.bool_],
    problem: str,
    points: Array,
    rows: NDArray[np.bool_] | None,
    name: str,
    *,
    drop: bool,
) -> tuple[Array, NDArray[np.bool_] | None]:
    if drop:
        return points[~there], _kept(rows, ~there)
    warnings.warn(
        f"{name}: {int(np.count_nonzero(there))} of {len(points)} points {problem}; remove them{OR_DROP}",
        UserWarning,
        stacklevel=6,
    )
    return points, rows


def _away_from(
    place: Array, why: str, points: Array, rows: NDArray[np.bool_] | None, name: str, *, drop: bool
) -> tuple[Array, NDArray[np.bool_] | None]:
    fewest = max(MIN_POINTS, _FILLED * len(points))
    if np.count_nonzero(points[:, 0] == place[0]) < fewest:
        return points, rows
    there: NDArray[np.bool_] = np.asarray((points == place).all(axis=1))
    if np.count_nonzero(there) < fewest or there.all():
        return points, rows
    where = ", ".join(f"{each:.6g}" for each in place)
    return _without(there, f"lie exactly at ({where}), {why}", points, rows, name, drop=drop)


def _met(
    points: Array, rows: NDArray[np.bool_] | None, name: str, *, drop: bool
) -> tuple[Array, NDArray[np.bool_] | None]:
    found = farthest_shell(points)
    if found is None:
        return points, rows
    place = "the origin" if not found.centre.any() else f"({', '.join(f'{c:.7g}' for c in found.centre)})"
    others = "all others nearer" if found.farthest else "in all directions"
    problem = (
        f"lie {found.reach:.5g} m from {place}, {others}, as the ends of simulated rays do that met nothing"
    )
    return _without(found.there, problem, points, rows, name, drop=drop)


def _measured(
    points: Array, rows: NDArray[np.bool_] | None, name: str, *, drop: bool
) -> tuple[Array, NDArray[np.bool_] | None]:
    for height in (float(points[:, 2].min(initial=0.0)), float(points[:, 2].max(initial=0.0))):
        if height not in _NO_HEIGHT:
            continue
        there = points[:, 2] == height
        if there.all() or (np.sign(height) * points[~there, 2]).max() > 0.5 * abs(height):
            continue
        problem = f"have the height {height:.12g}, which rasters write for cells without data"
        points, rows = _without(there, problem, points, rows, name, drop=drop)
    return points, rows


def _kept(rows: NDArray[np.bool_] | None, good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    kept = np.ones(len(good), dtype=bool) if rows is None else rows.copy()
    kept[kept] = good
    return kept


def rounded(points: Array, name: str) -> None:
    """Warn of coordinates on a map grid that were kept in single precision, half a metre apart at 5,000 km, or were
    written with six digits, as C and C++ write numbers unless they are told otherwise: ten metres apart there."""
    some = points[:: max(1, len(points) // _LOOKED_AT)]
    some = some[some.any(axis=1)]  # missing returns lie at zero
    if not len(some):
        return
    away = np.median(np.abs(some), axis=0)  # where most points lie: a stray one may be anywhere
    with np.errstate(over="ignore", invalid="ignore"):
        single = some.astype(np.float32)
        kept_so = (single == some).all(axis=0)
        steps = np.where(kept_so, np.spacing(away.astype(np.float32)), 0.0)
        units = 10.0 ** (
            np.floor(np.log10(np.where(some == 0.0, 1.0, np.maximum(np.abs(some), _TINY)))) - 5.0
        )
        written_so = bool((np.abs(some / units - np.round(some / units)) < _WHOLE).all())
    step = float(steps.max())
    sixths = 10.0 ** (np.floor(np.log10(np.maximum(away, _TINY))) - 5.0)
    sixth = float(sixths.max())
    finer = (np.abs(np.remainder(some, 10.0 * sixth)) > 0.5 * sixth).any()
    if written_so and sixth > _COARSE and finer and not _on_grid(some, sixths):
        _tell_rounded(name, "written with six digits", "with more digits, or binary", sixth)
    elif step > _COARSE and not _on_grid(some, steps):
        _tell_rounded(name, "kept in single precision", "in double precision", step)


def columns(points: Array, name: str) -> None:
    """Warn of a column that is no coordinate: the number of a ring, an intensity, another column once more; or that is
    the far plane of a depth image in many points."""
    for problem in filter(None, (no_coordinate(points), far_plane(points))):
        warnings.warn(f"{name}: {problem}", UserWarning, stacklevel=4)


def _on_grid(some: Array, steps: Array) -> bool:
    """Whether x or y lies on a grid, as heights do, whose numbers have few digits by themselves: on coarser steps than
    rounding leaves, `steps` (3,)."""
    flat = some[:, :2]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.remainder(flat - flat[0], np.maximum(2.0 * steps[:2], steps.max()))
        return bool((~off.any(axis=0) & (np.ptp(flat, axis=0) > 0.0)).any())


def _tell_rounded(name: str, problem: str, cure: str, step: float) -> None:
    warnings.warn(
        f"{name}: its coordinates were {problem} far from the origin, {step:.2g} m apart; export them {cure}, or "
        "subtract a local origin before they are stored",
        UserWarning,
        stacklevel=5,
    )


def check(points: Array, name: str) -> None:
    """Refuse clouds that no pose can be computed from.

    Raises
    ------
    ValueError
        Fewer than 20 points, points that are not finite or beyond 1.5e11 m, all in one place, or all on one line.
    """
    finite(points, name, drop=False)
    if len(points) == 0:
        raise ValueError(f"{name}: the cloud is empty; it needs at least {MIN_POINTS} points")
    if len(points) < MIN_POINTS:
        raise ValueError(f"{name}: {len(points)} points are too few; it needs at least {MIN_POINTS}")
    low, high, middle = _reach(points)
    largest = float(max(np.abs(low).max(), np.abs(high).max()))
    if largest > _LARGEST:
        beyond = int((np.abs(points) > _LARGEST).any(axis=1).sum())
        raise ValueError(
            f"{name}: a coordinate of {largest:.3g} m cannot be real, {beyond} of {len(points)} points have such "
            "a one; check the file and its unit, or remove them where they stand for missing returns"
        )
    longest = float((high - low).max())
    if not longest > 1e-9 * max(largest, 1e-300):
        raise ValueError(
            f"{name}: all {len(points)} points lie in one place; a pose needs points spread in space"
        )
    scatter = sum(centred @ centred.T for rows in _lots(points) for centred in [(rows - middle) / longest])
    spread = np.linalg.svd(scatter, compute_uv=False)
    if spread[1] <= _THINNEST**2 * spread[0]:
        _refuse_filled(points, name)
        raise ValueError(
            f"{name}: all {len(points)} points lie on one line; the rotation about it is free, add points off the line"
        )


def _refuse_filled(points: Array, name: str) -> None:
    # So far away that the others lie in one place beside it: no line of points.
    away = np.abs(points).max(axis=1)
    far = points[away == away.max()]
    if len(far) > 1 and len(points) - len(far) >= MIN_POINTS and (far == far[0]).all():
        place = ", ".join(f"{each:g}" for each in far[0])
        raise ValueError(
            f"{name}: {len(far)} of {len(points)} points lie exactly at ({place}), as drivers write for missing "
            "returns; remove them"
        )


def _lots(points: Array) -> Iterator[Array]:
    # numpy reduces three rows several times as fast as three columns; in batches no copy of all is made.
    return (np.ascontiguousarray(points[k : k + _LOT].T) for k in range(0, len(points), _LOT))


def _reach(points: Array) -> tuple[Array, Array, Array]:
    """Lower and upper corner (3,), and middle (3, 1)."""
    lots = [(rows.min(axis=1), rows.max(axis=1), rows.sum(axis=1)) for rows in _lots(points)]
    low, high, total = (np.array(each) for each in zip(*lots, strict=True))
    return low.min(axis=0), high.max(axis=0), total.sum(axis=0)[:, None] / len(points)
