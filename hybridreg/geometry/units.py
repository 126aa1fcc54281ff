# SPDX-License-Identifier: MIT
"""Coordinates that are probably not in metres: of which cloud, and in which unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import reach, some

if TYPE_CHECKING:
    from hybridreg.cloud import PointCloud
    from hybridreg.pair import Pair

Array = NDArray[np.float64]

_UNITS = ((1e-3, "millimetres"), (1e-2, "centimetres"), (0.0254, "inches"))
# Extents of most scans, from an object on a table to a street; by hand.
_SHORTEST = 0.3  # metres
_LONGEST = 300.0  # metres
_USUAL = 15.0  # metres, about the geometric middle
_UNLIKE = 25.0  # factor: extents of two clouds of one place differ by less; by hand
_NEAR = 5.0  # factor by which their ratio may differ from that of two units; by hand
_AS_NEAR = 3.0  # factor within which two units explain a ratio about as well; by hand
_DEGREES = 0.2  # degrees: extent of a scan in longitude and latitude, at most; by hand
_UPRIGHT = 100.0  # least ratio to that of its spread along z, which is in metres; by hand
_LOOKED_AT = 2_000


def doubts(pair: Pair) -> dict[str, str]:
    """A sentence for each cloud, by "source" and "target", whose coordinates are probably not in metres."""
    found: dict[str, str] = {}
    clouds = {"source": pair.source, "target": pair.target}
    for name, cloud in clouds.items():
        other = clouds["target" if name == "source" else "source"]
        text = _degrees(cloud) or _whole_numbers(cloud, other)
        if text:
            found[name] = text
    return found or _unlike(pair)


def _degrees(cloud: PointCloud) -> str:
    points = some(cloud.points)
    low, middle, high = np.quantile(points[:: max(1, len(points) // 20_000)], [0.05, 0.5, 0.95], axis=0)
    wide, at = high - low, np.abs(middle + cloud.offset)
    flat = max(wide[0], wide[1])
    on_earth = at[0] <= 180.0 and at[1] <= 90.0 and max(at[0], at[1]) > 1.0
    if not (on_earth and 0.0 < flat < _DEGREES and wide[2] > _UPRIGHT * flat):
        return ""
    return (
        f"x and y lie within {wide[0]:.2g} and {wide[1]:.2g} of ({middle[0]:.6g}, {middle[1]:.6g}), z spreads over "
        f"{wide[2]:.3g}: longitude and latitude in degrees? Project them to metres first, for example to UTM"
    )


def _is_whole(cloud: PointCloud) -> bool:
    points = cloud.points
    few = points[:: max(1, len(points) // _LOOKED_AT)]
    if not np.array_equal(few, np.round(few)):
        return False
    every = some(points)
    return bool(np.array_equal(every, np.round(every)))


def _whole_numbers(cloud: PointCloud, other: PointCloud) -> str:
    if not _is_whole(cloud):
        return ""
    own = reach(cloud.radii)
    if own <= 0.0:
        return ""
    if not _is_whole(other) and _plausible(other):  # its extent, in metres, is the best guess of this one's
        aim = reach(other.radii)
        likely = [min(_UNITS[:2], key=lambda each: abs(np.log(own * each[0] / aim)))]
    else:  # 1600 is a table before a depth camera, or a hall
        likely = [each for each in _UNITS[:2] if _SHORTEST <= own * each[0] <= _LONGEST]
        likely = likely or [min(_UNITS[:2], key=lambda each: abs(np.log(own * each[0] / _USUAL)))]
    return f"every coordinate is a whole number, and it reaches {own:.3g}: {_named(likely)}"


def _plausible(cloud: PointCloud) -> bool:
    return _SHORTEST <= reach(cloud.radii) <= _LONGEST


def _unlike(pair: Pair) -> dict[str, str]:
    # The clouds are in different units: the one with an extent that no sensor has is at fault.
    reaches = {"source": reach(pair.source.radii), "target": reach(pair.target.radii)}
    small, large = sorted(reaches, key=lambda name: reaches[name])
    if reaches[small] <= 0.0 or reaches[large] < _UNLIKE * reaches[small]:
        return {}
    ratio = reaches[large] / reaches[small]
    told = f"{reaches[large]:.3g} m where the {small} reaches {reaches[small]:.3g} m"
    if _plausible(getattr(pair, large)) and not _plausible(getattr(pair, small)):
        unit = "kilometres, or scaled to a unit cube" if ratio < 1e3 * _NEAR else "scaled"
        return {
            small: f"it reaches {reaches[small]:.3g} m where the {large} reaches {reaches[large]:.3g} m: probably "
            f"{unit}; lengths here are metres"
        }
    likely = _likely(ratio)
    if not likely:
        return {large: f"it reaches {told}: is one of them in another unit, or another place?"}
    return {large: f"it reaches {told}: {_named(likely)}"}


def _named(likely: list[tuple[float, str]]) -> str:
    units = " or ".join(unit for _, unit in likely)
    factors = " or ".join(f"{metres:g}" for metres, _ in likely)
    return f"probably {units}; multiply by {factors} if so, lengths here are metres"


def _likely(ratio: float) -> list[tuple[float, str]]:
    """Units that explain why a cloud reaches so many times as far as one in metres, the likeliest first."""

    def off(each: tuple[float, str]) -> float:
        return abs(float(np.log(ratio * each[0])))

    near = sorted((each for each in _UNITS if off(each) < np.log(_NEAR)), key=off)
    return [each for each in near if off(each) - off(near[0]) < np.log(_AS_NEAR)]
