# SPDX-License-Identifier: MIT
"""What a registration returns."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import rows_of
from hybridreg.evidence.covariance import of_information
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import Overlay
from hybridreg.matches import Correspondences, EntryTrace
from hybridreg.output import picture, result_words
from hybridreg.output.pose_text import pose_text
from hybridreg.resolution import VEHICLES, Tolerance
from hybridreg.runtime.read_only import lock

Array = NDArray[np.float64]
Word = Literal["ok", "doubtful", "failed"]


# Numbers measured on the whole clouds.
_MEASURED = ("fitness", "inlier_rmse", "fitness_target", "max_distance")


@dataclass(frozen=True, eq=False, kw_only=True)
class RegistrationResult:
    """The pose, and whether to believe it.

    Attributes
    ----------
    transformation : (4, 4) float64
        Maps source points to target points, `q = R p + t` (`q = R (scale p) + t` where the scale was estimated), in the
        coordinates that the user gave. Its rotation is orthogonal with determinant +1. `T_target_source` is another
        name for it.
    verdict : "ok", "doubtful" or "failed"
        By `confidence`: "ok" from 0.95 on, "failed" below 0.5, "doubtful" in between: the evidence does not decide.
    confidence : float in [0, 1]
        Estimated probability that the pose is right, to `tolerance`.
    reasons : tuple of str
        The verdict explained in sentences, most serious first.
    overlay : Overlay
        Both whole clouds at the pose, on which `fitness` and its companions are computed on first access.
    information : (6, 6) float64
        Sum of J^T J of point-to-plane distances in metres at the pose, rotation (radians) before translation,
        about the centre of the overlap; a small eigenvalue is a poorly constrained direction.
    rivals : (r, 4, 4) float64
        Other poses that explain the data nearly as well, or would be likely were there no better one.
    matches : Correspondences
        What the pose was estimated from, in the user's coordinates; where several matchers ran, the matches of the one
        that agrees best with the pose.
    evidence : mapping of str to float
        The numbers behind the verdict.
    notes : tuple of str
        Defaults that were chosen and limits that were reached.
    seconds : mapping of str to float
        Wall time of each slot and of the verdict; what an estimator matches, refines or weighs on its own counts
        there.
    peak_memory_mb : float or None
        Peak resident memory of the process during the run.
    seed : int
    spec : mapping
        The pipeline that made it, as `Pipeline.save` writes it.
    entries : tuple of EntryTrace
        What each entry of `Candidates` did, how long it took, and which one the pose came from; empty where the
        pipeline has one estimator.
    tolerance : Tolerance
        What "right" means to `confidence`: within so many degrees, and so many metres at the middle of the source.
    centre : (3,) float64
        Centre of the overlap in the target's coordinates, about which `information` and `covariance` count turns.
    scale : float
        What to multiply the source's coordinates by before the transformation: other than 1 only where `scale=True`
        asked for it.
    scale_verdict : "ok", "doubtful", "failed" or None
        Whether to believe the scale; None where it was not asked for.
    found : bool
        Whether any pose was found. Where none was, the verdict is "failed" and `transformation` the identity.
    """

    transformation: Array
    verdict: Word
    confidence: float
    reasons: tuple[str, ...]
    overlay: Overlay
    information: Array = field(repr=False)
    rivals: Array = field(repr=False)
    matches: Correspondences = field(repr=False)
    evidence: Mapping[str, float] = field(repr=False)
    notes: tuple[str, ...]
    seconds: Mapping[str, float]
    peak_memory_mb: float | None
    seed: int
    spec: Mapping[str, Any] = field(repr=False)
    tolerance: Tolerance = VEHICLES
    entries: tuple[EntryTrace, ...] = ()
    centre: Array = field(default_factory=lambda: np.zeros(3), repr=False)
    scale: float = 1.0
    scale_verdict: Word | None = None
    found: bool = True

    def __post_init__(self) -> None:
        lock(self, "transformation", "information", "rivals", "centre")

    @property
    def T_target_source(self) -> Array:
        """The transformation, under the name that states its direction."""
        return self.transformation

    @property
    def fitness(self) -> float:
        """Share of the source's points that have a target point within `max_distance`, as in Open3D."""
        return self.overlay.of_source.fitness

    @property
    def inlier_rmse(self) -> float:
        """Root mean square distance of those points, metres, as in Open3D."""
        return self.overlay.of_source.inlier_rmse

    @property
    def correspondence_set(self) -> NDArray[np.int64]:
        """Those points (K, 2): row in the source, row of the nearest target point, as in Open3D."""
        return self.overlay.of_source.correspondence_set

    @property
    def fitness_target(self) -> float:
        """The same share for the target's points."""
        return self.overlay.of_target.fitness

    @property
    def max_distance(self) -> float:
        """Largest distance between two points of `correspondence_set`, metres."""
        return self.overlay.max_distance

    @cached_property
    def covariance(self) -> Array:
        """Covariance (6, 6) of a right pose's error: turns about `centre` (radians) before translations (metres), along
        the target's axes; infinite where the surfaces leave a direction open. See `hybridreg.evidence.covariance` for
        what its scale was checked against. It says nothing of a wrong pose: that is `confidence`."""
        found = of_information(self.information, self.tolerance)
        found.setflags(write=False)
        return found

    def apply(self, points: Any) -> Array:
        """Points of the source (N, 3), or any cloud that `PointCloud.of` takes, in the target's coordinates: (N, 3).

        Every row stays, however few there are and whether finite or not, so that colours and labels still go with
        them; (3, N) is taken for channels first, as everywhere.
        """
        return se3.apply(self.transformation, rows_of(points, "points") * self.scale)

    def format(self, form: str) -> str:
        """The pose as "matrix", "quaternion", "ros-tf", "urdf", "cloudcompare", "kitti" or "tum"; see
        `hybridreg.output.pose_text.FORMATS`."""
        return pose_text(self.transformation, form)

    def summary(self) -> str:
        """A few lines to print: verdict, pose, spread, reasons, notes."""
        return result_words.summary(self)

    def plot(self) -> Any:
        """A plotly figure of both clouds (extra `report`): `result.plot().show()`, or `.write_html("a.html")`."""
        return picture.figure(self.overlay)

    def _repr_html_(self) -> str:
        return result_words.html(self)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and strings; the per-point arrays become their counts. `hybridreg` is the version; of
        `covariance` what is infinite is None."""
        left_out = {"overlay", "matches"}
        plain = {f.name: _plain(getattr(self, f.name)) for f in fields(self) if f.name not in left_out}
        plain |= {name: getattr(self, name) for name in _MEASURED}
        # JSON has no infinity.
        plain["covariance"] = [
            [x if np.isfinite(x) else None for x in row] for row in self.covariance.tolist()
        ]
        counts = {"n_correspondences": len(self.correspondence_set), "n_matches": len(self.matches)}
        return {**plain, **counts, "hybridreg": _version()}

    def to_json(self) -> str:
        """`to_dict` as JSON text."""
        return json.dumps(self.to_dict(), indent=2)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result whole: `.json` everything, `.txt` the 4x4 matrix alone."""
        from hybridreg.io import write_json, write_matrix

        if os.fspath(path).endswith(".txt"):
            write_matrix(path, self.transformation)
        elif os.fspath(path).endswith(".json"):
            write_json(path, self.to_dict())
        else:
            raise ValueError(
                f"{os.fspath(path)}: a result is saved as .json (everything) or .txt (the 4x4 matrix)"
            )


def _version() -> str:
    from hybridreg import __version__

    return __version__


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (Tolerance, EntryTrace)):
        return value._asdict()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value
