# SPDX-License-Identifier: MIT
"""ITK's transforms map the other way, in millimetres and along other axes: they are refused with what to give."""

from __future__ import annotations

from pathlib import Path

import pytest

from hybridreg.io.poses.pose_file import read_pose

# In the form that SimpleITK writes.
TRANSFORM = """#Insight Transform File V1.0
#Transform 0
Transform: AffineTransform_double_3_3
Parameters: 0.98 -0.19 0 0.19 0.98 0 0 0 1 75 -15 0.1
FixedParameters: 0 0 0
"""


@pytest.mark.parametrize("ending", [".tfm", ".txt"])
def test_a_transform_of_itk_is_refused_with_its_direction_and_unit(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"pose{ending}"
    path.write_text(TRANSFORM)
    with pytest.raises(
        ValueError, match="maps the fixed image to the moving one, in millimetres, .*its inverse"
    ):
        read_pose(path)
