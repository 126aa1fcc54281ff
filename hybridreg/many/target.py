# SPDX-License-Identifier: MIT
"""A target that many scans are registered to: read, checked, gridded and indexed once."""

from __future__ import annotations

from typing import Any, Literal

from hybridreg import api
from hybridreg.cloud import PointCloud
from hybridreg.geometry.viewpoint import Given
from hybridreg.io.recorded.recording import ANY, Selection
from hybridreg.result import RegistrationResult


class Target:
    """A map, or any other cloud that does not change; give it to `register` in the target's place.

    What the first registration makes of it (its grid, trees, normals, ground, range image) is kept for those that
    follow. Voxels that are derived from the clouds are rounded to steps of a quarter, so that scans of one sensor share
    them: a result may differ from that of an independent `register` by as much as another voxel makes.

    Parameters
    ----------
    cloud, nonfinite, viewpoint, select : as for `PointCloud.of`

    Raises
    ------
    ValueError, FileNotFoundError, ImportError
        As `PointCloud.of`.
    """

    def __init__(
        self,
        cloud: Any,
        *,
        nonfinite: Literal["raise", "drop"] = "raise",
        viewpoint: Given = "auto",
        select: Selection = ANY,
    ) -> None:
        checked = PointCloud.of(cloud, name="target", nonfinite=nonfinite, viewpoint=viewpoint, select=select)
        self.prepared = checked.keeping()

    def __len__(self) -> int:
        return len(self.prepared)

    def register(self, source: Any, image: Any = None, **how: Any) -> RegistrationResult:
        """`hybridreg.register(source, self, image, **how)`."""
        return api.register(source, self, image, **how)
