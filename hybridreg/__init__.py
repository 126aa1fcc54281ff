# SPDX-License-Identifier: MIT
"""Registration of point clouds from different sensors: every stage a slot, classical or learned.

>>> import hybridreg as hr
>>> result = hr.register("fan.ply", "rings.ply", image="front.png")
>>> result.verdict, result.transformation
"""

from importlib import import_module as _import_module
from pathlib import Path as _Path
from typing import TYPE_CHECKING
from typing import Any as _Any

# In a checkout `classical/`, `learned/` and `eval/` lie beside this package; a wheel carries them inside it.
_root = _Path(__file__).resolve().parent.parent
if (_root / "pyproject.toml").is_file() and (_root / "classical").is_dir():
    __path__.append(str(_root))

if TYPE_CHECKING:  # "X as X" tells type checkers that the name is public
    from hybridreg.api import read as read
    from hybridreg.api import register as register
    from hybridreg.candidates.candidates import Candidates as Candidates
    from hybridreg.classical.fgr import Fgr as Fgr
    from hybridreg.classical.fpfh import Fpfh as Fpfh
    from hybridreg.classical.gicp import Gicp as Gicp
    from hybridreg.classical.hcf.hcf import Hcf as Hcf
    from hybridreg.classical.icp import Icp as Icp
    from hybridreg.classical.kiss import KissMatcher as KissMatcher
    from hybridreg.classical.kiss_icp import KissIcp as KissIcp
    from hybridreg.classical.manhattan import Manhattan as Manhattan
    from hybridreg.classical.nothing import GivenMatches as GivenMatches
    from hybridreg.classical.nothing import Identity as Identity
    from hybridreg.classical.nothing import NoMatch as NoMatch
    from hybridreg.classical.nothing import NoOverlap as NoOverlap
    from hybridreg.classical.nothing import NoRefinement as NoRefinement
    from hybridreg.classical.overhead.birdseye import BirdsEye as BirdsEye
    from hybridreg.classical.overhead.relief_search import ReliefSearch as ReliefSearch
    from hybridreg.classical.ransac import Ransac as Ransac
    from hybridreg.classical.ransac_50k import Ransac50k as Ransac50k
    from hybridreg.classical.sampling import AllPoints as AllPoints
    from hybridreg.classical.sampling import RandomSample as RandomSample
    from hybridreg.classical.svd import WeightedSvd as WeightedSvd
    from hybridreg.classical.visibility import Visibility as Visibility
    from hybridreg.classical.voxel import VoxelGrid as VoxelGrid
    from hybridreg.cloud import PointCloud as PointCloud
    from hybridreg.learned.cofinet.stage import Cofinet as Cofinet
    from hybridreg.learned.fcgf.stage import Fcgf as Fcgf
    from hybridreg.learned.omnet.stage import OmNet as OmNet
    from hybridreg.learned.predator.stage import Predator as Predator
    from hybridreg.learned.predator.stage import PredatorOverlap as PredatorOverlap
    from hybridreg.learned.roitr.stage import Roitr as Roitr
    from hybridreg.learned.stages.dense import DenseFeatures as DenseFeatures
    from hybridreg.learned.stages.geotransformer import GeoTransformer as GeoTransformer
    from hybridreg.learned.stages.lgr import Lgr as Lgr
    from hybridreg.learned.stages.omp import Omp as Omp
    from hybridreg.learned.stages.vgam import Vgam as Vgam
    from hybridreg.learned.vrhcf.stage import Vrhcf as Vrhcf
    from hybridreg.many.alignment import Alignment as Alignment
    from hybridreg.many.register_all import register_all as register_all
    from hybridreg.many.target import Target as Target
    from hybridreg.matches import Correspondences as Correspondences
    from hybridreg.matches import Overlap as Overlap
    from hybridreg.matches import Pose as Pose
    from hybridreg.pair import LabelledPair as LabelledPair
    from hybridreg.pair import Pair as Pair
    from hybridreg.pipeline import Pipeline as Pipeline
    from hybridreg.pipeline import Trace as Trace
    from hybridreg.result import RegistrationResult as RegistrationResult
    from hybridreg.scene import Level as Level
    from hybridreg.scene import Scene as Scene
    from hybridreg.stage import Stage as Stage

_WHERE = {
    "hybridreg.api": ["read", "register"],
    "hybridreg.classical.overhead.birdseye": ["BirdsEye"],
    "hybridreg.candidates.candidates": ["Candidates"],
    "hybridreg.classical.fgr": ["Fgr"],
    "hybridreg.classical.fpfh": ["Fpfh"],
    "hybridreg.classical.gicp": ["Gicp"],
    "hybridreg.classical.hcf.hcf": ["Hcf"],
    "hybridreg.classical.icp": ["Icp"],
    "hybridreg.classical.kiss": ["KissMatcher"],
    "hybridreg.classical.kiss_icp": ["KissIcp"],
    "hybridreg.classical.manhattan": ["Manhattan"],
    "hybridreg.classical.nothing": ["GivenMatches", "Identity", "NoMatch", "NoOverlap", "NoRefinement"],
    "hybridreg.classical.ransac": ["Ransac"],
    "hybridreg.classical.ransac_50k": ["Ransac50k"],
    "hybridreg.classical.overhead.relief_search": ["ReliefSearch"],
    "hybridreg.classical.sampling": ["AllPoints", "RandomSample"],
    "hybridreg.classical.svd": ["WeightedSvd"],
    "hybridreg.classical.visibility": ["Visibility"],
    "hybridreg.classical.voxel": ["VoxelGrid"],
    "hybridreg.cloud": ["PointCloud"],
    "hybridreg.learned.cofinet.stage": ["Cofinet"],
    "hybridreg.learned.fcgf.stage": ["Fcgf"],
    "hybridreg.learned.omnet.stage": ["OmNet"],
    "hybridreg.learned.predator.stage": ["Predator", "PredatorOverlap"],
    "hybridreg.learned.roitr.stage": ["Roitr"],
    "hybridreg.learned.stages.dense": ["DenseFeatures"],
    "hybridreg.learned.stages.geotransformer": ["GeoTransformer"],
    "hybridreg.learned.stages.lgr": ["Lgr"],
    "hybridreg.learned.stages.omp": ["Omp"],
    "hybridreg.learned.stages.vgam": ["Vgam"],
    "hybridreg.learned.vrhcf.stage": ["Vrhcf"],
    "hybridreg.many.alignment": ["Alignment"],
    "hybridreg.many.register_all": ["register_all"],
    "hybridreg.many.target": ["Target"],
    "hybridreg.matches": ["Correspondences", "Overlap", "Pose"],
    "hybridreg.pair": ["LabelledPair", "Pair"],
    "hybridreg.pipeline": ["Pipeline", "Trace"],
    "hybridreg.result": ["RegistrationResult"],
    "hybridreg.scene": ["Level", "Scene"],
    "hybridreg.stage": ["Stage"],
}
_MODULE_OF = {name: module for module, names in _WHERE.items() for name in names}

__version__ = "0.1.0"
__all__ = sorted([*_MODULE_OF, "__version__"])


def __getattr__(name: str) -> _Any:
    # Names are imported when they are asked for, so that `import hybridreg` costs next to nothing.
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'hybridreg' has no attribute {name!r}")
    from hybridreg.runtime import optional_packages

    with optional_packages.told(f"hybridreg.{name}"):
        return getattr(_import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
