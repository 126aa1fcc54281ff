# SPDX-License-Identifier: MIT
"""Short names of stages, and the classes behind them, imported on demand."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from hybridreg.config.near_name import did_you_mean
from hybridreg.runtime import optional_packages, plugins
from hybridreg.slots import SLOTS

ENTRY_POINTS = "hybridreg.stages"

BUILT_IN = {
    "downsample.voxel": "hybridreg.classical.voxel:VoxelGrid",
    "downsample.random": "hybridreg.classical.sampling:RandomSample",
    "downsample.none": "hybridreg.classical.sampling:AllPoints",
    "overlap.none": "hybridreg.classical.nothing:NoOverlap",
    "overlap.visibility": "hybridreg.classical.visibility:Visibility",
    "overlap.omp": "hybridreg.learned.stages.omp:Omp",
    "overlap.predator": "hybridreg.learned.predator.stage:PredatorOverlap",
    "match.none": "hybridreg.classical.nothing:NoMatch",
    "match.given": "hybridreg.classical.nothing:GivenMatches",
    "match.fpfh": "hybridreg.classical.fpfh:Fpfh",
    "match.vgam": "hybridreg.learned.stages.vgam:Vgam",
    "match.geotransformer": "hybridreg.learned.stages.geotransformer:GeoTransformer",
    "match.dense": "hybridreg.learned.stages.dense:DenseFeatures",
    "match.fcgf": "hybridreg.learned.fcgf.stage:Fcgf",
    "match.predator": "hybridreg.learned.predator.stage:Predator",
    "match.cofinet": "hybridreg.learned.cofinet.stage:Cofinet",
    "match.roitr": "hybridreg.learned.roitr.stage:Roitr",
    "match.vrhcf": "hybridreg.learned.vrhcf.stage:Vrhcf",
    "estimate.identity": "hybridreg.classical.nothing:Identity",
    "estimate.ransac": "hybridreg.classical.ransac:Ransac",
    "estimate.ransac-50k": "hybridreg.classical.ransac_50k:Ransac50k",
    "estimate.svd": "hybridreg.classical.svd:WeightedSvd",
    "estimate.fgr": "hybridreg.classical.fgr:Fgr",
    "estimate.hcf": "hybridreg.classical.hcf.hcf:Hcf",
    "estimate.kiss": "hybridreg.classical.kiss:KissMatcher",
    "estimate.birdseye": "hybridreg.classical.overhead.birdseye:BirdsEye",
    "estimate.manhattan": "hybridreg.classical.manhattan:Manhattan",
    "estimate.relief": "hybridreg.classical.overhead.relief_search:ReliefSearch",
    "estimate.candidates": "hybridreg.candidates.candidates:Candidates",
    "estimate.lgr": "hybridreg.learned.stages.lgr:Lgr",
    "estimate.omnet": "hybridreg.learned.omnet.stage:OmNet",
    "refine.none": "hybridreg.classical.nothing:NoRefinement",
    "refine.icp": "hybridreg.classical.icp:Icp",
    "refine.gicp": "hybridreg.classical.gicp:Gicp",
    "refine.kiss-icp": "hybridreg.classical.kiss_icp:KissIcp",
}


@cache
def known() -> dict[str, str]:
    """Every stage that can be named, as `slot.name` to `module:Class`; plug-ins included."""
    plugged = {point.name: point.value for point in entry_points(group=ENTRY_POINTS)}
    # A plug-in cannot take a built-in's name: the same pipeline file must mean the same everywhere.
    return {**plugged, **BUILT_IN}


def names(slot: str) -> list[str]:
    """Short names of one slot's stages."""
    return sorted(key.partition(".")[2] for key in known() if key.startswith(f"{slot}."))


def load(slot: str, name: str) -> type[Any]:
    """Class of a stage.

    Raises
    ------
    KeyError
        For a name that is not registered; the message lists the known ones.
    ImportError
        A plug-in that cannot be loaded, whatever its import raises; a package that is not installed, with the extra
        that brings it.
    """
    if slot not in SLOTS:
        raise KeyError(f"no slot is called {slot!r}; the slots are {', '.join(SLOTS)}")
    target = known().get(f"{slot}.{name}")
    if target is None:
        hint = did_you_mean(name, names(slot)) or "."
        raise KeyError(f"no {slot} stage is called {name!r}{hint} Known: {', '.join(names(slot))}")
    if f"{slot}.{name}" not in BUILT_IN:
        return plugins.load(target, f"{slot} stage {name!r}", ENTRY_POINTS)
    module, _, attribute = target.partition(":")
    with optional_packages.told(f'{slot}="{name}"'):
        cls: type[Any] = getattr(import_module(module), attribute)
    return cls


def name_of(stage: Any) -> str | None:
    """Registered `slot.name` of a stage, or None for a class that is not registered."""
    cls = type(stage)
    here = f"{cls.__module__}:{cls.__qualname__}"
    return next((key for key, target in known().items() if target == here), None)


def slot_fits(slot: str, *, needs: frozenset[str] | None = None, gives: str | None = None) -> list[str]:
    """Names of a slot's stages that need no more than `needs`, or that give the word `gives`."""
    found = []
    for name in names(slot):
        try:
            cls = load(slot, name)
        except ImportError:
            continue
        if needs is not None and getattr(cls, "needs", frozenset()) <= needs:
            found.append(name)
        if gives is not None and gives in getattr(cls, "gives", frozenset()):
            found.append(name)
    return found
