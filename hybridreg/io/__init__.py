# SPDX-License-Identifier: MIT
"""Reading clouds and camera images; writing clouds, transforms and records."""

from hybridreg.io.atomic import atomic_path, write_bytes, write_text
from hybridreg.io.formats.image import as_image, check_image, read_image
from hybridreg.io.point_files import read_points, read_recorded, read_viewpoint
from hybridreg.io.write import write_json, write_matrix, write_points

__all__ = [
    "as_image",
    "atomic_path",
    "check_image",
    "read_image",
    "read_points",
    "read_recorded",
    "read_viewpoint",
    "write_bytes",
    "write_json",
    "write_matrix",
    "write_points",
    "write_text",
]
