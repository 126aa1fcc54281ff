# SPDX-License-Identifier: MIT
"""What surfaces are made of, for the laser and for the camera. A table: add a row to add a material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Material:
    """How one kind of surface reflects a laser pulse and how it looks."""

    name: str
    reflectivity: float  # share of near-infrared light (905 nm) sent back at right angles
    roughness: float  # metres by which the surface itself scatters a measured range (grass, leaves, gravel)
    lost: float  # share of pulses that never come back (mirrored away or passed through)
    texture: str  # pattern that the camera sees, one of texture.PATTERNS
    contrast: float  # strength of that pattern
    gloss: float = 0.0  # share of the sky mirrored in the picture
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5)  # as ground; other faces have their own tint


MATERIALS = (
    # Terrain triangles have this one; the layout says which of the next six a hit is.
    Material("ground", 0.30, 0.010, 0.01, "none", 0.0),
    Material("asphalt", 0.20, 0.006, 0.01, "speckle", 0.10, colour=(0.30, 0.30, 0.31)),
    Material("paving", 0.32, 0.005, 0.01, "tiles", 0.16, colour=(0.52, 0.51, 0.49)),
    Material("grass", 0.50, 0.035, 0.02, "grass", 0.28, colour=(0.27, 0.37, 0.14)),
    Material("meadow", 0.50, 0.110, 0.03, "grass", 0.35, colour=(0.36, 0.38, 0.17)),  # tall grass and weeds
    Material("soil", 0.30, 0.025, 0.02, "patches", 0.25, colour=(0.38, 0.31, 0.22)),
    Material("gravel", 0.30, 0.020, 0.02, "speckle", 0.22, colour=(0.50, 0.47, 0.42)),
    Material("brick", 0.35, 0.006, 0.01, "bricks", 0.30),
    Material("plaster", 0.55, 0.004, 0.01, "stains", 0.12),
    Material("concrete", 0.40, 0.004, 0.01, "stains", 0.18),
    Material("glass", 0.10, 0.010, 0.75, "none", 0.0, 0.55),
    Material("paint", 0.45, 0.004, 0.12, "none", 0.0, 0.16),
    Material("dark_paint", 0.10, 0.004, 0.35, "none", 0.0, 0.16),
    Material("rubber", 0.06, 0.006, 0.05, "none", 0.0),
    Material("bark", 0.30, 0.015, 0.01, "patches", 0.30),
    Material("leaves", 0.50, 0.030, 0.03, "leaves", 0.35),
    Material("metal", 0.45, 0.004, 0.10, "stains", 0.10, 0.08),
    Material("cloth", 0.40, 0.012, 0.01, "patches", 0.15),
    Material("sign", 0.90, 0.004, 0.0, "none", 0.0),
    Material("roof", 0.30, 0.010, 0.01, "tiles", 0.25),
    Material("wood", 0.45, 0.006, 0.01, "stains", 0.25),
)
MATERIAL_INDEX = {material.name: index for index, material in enumerate(MATERIALS)}
REFLECTIVITY = np.array([m.reflectivity for m in MATERIALS], np.float32)
ROUGHNESS = np.array([m.roughness for m in MATERIALS], np.float32)
LOST = np.array([m.lost for m in MATERIALS], np.float32)
CONTRAST = np.array([m.contrast for m in MATERIALS], np.float32)
GLOSS = np.array([m.gloss for m in MATERIALS], np.float32)
COLOUR = np.array([m.colour for m in MATERIALS], np.float32)
GROUND = MATERIAL_INDEX["ground"]
