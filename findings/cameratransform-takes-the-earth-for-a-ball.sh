#!/usr/bin/env bash
# cameratransform 1.2.1 turns metres into latitudes and longitudes on a ball, by one radius for both: `gpsFromSpace` and
# `spaceFromGPS` are off by 3.2 m in a kilometre to the east, and by 0.6 m to the north, at a latitude of 52 degrees.
#
# Guess before it was run: within a centimetre of the ellipsoid's east, north, up over one kilometre.
# For whom it matters: whoever lays a camera's view over a georeferenced scan, or takes a start for a registration from such
# coordinates: what lies a kilometre away is metres off, and more to the east than to the north, so that no rigid pose undoes
# it. `pymap3d.geodetic2enu` and pyproj know the ellipsoid.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "cameratransform==1.2.1" "pymap3d==3.2.0" "numpy<2.5" "setuptools<81"
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np

warnings.simplefilter("ignore")
import cameratransform as ct
import pymap3d

AT = 52.0, 13.0
camera = ct.Camera(ct.RectilinearProjection(focallength_px=500, image=(640, 480)), ct.SpatialOrientation(elevation_m=10))
camera.setGPSpos(*AT, 0.0)
print("cameratransform", version("cameratransform"), "pymap3d", version("pymap3d"))
off = {}
for name, metres in {"east": (1000.0, 0.0, 0.0), "north": (0.0, 1000.0, 0.0)}.items():
    latitude, longitude, _ = camera.gpsFromSpace(np.array([metres]))[0]
    east, north, _ = pymap3d.geodetic2enu(latitude, longitude, 0.0, *AT, 0.0)
    there = np.array([float(east), float(north)])
    off[name] = float(np.linalg.norm(there - metres[:2]))
    print(f"1000 m {name}: its latitude and longitude lie {there.round(2)} m away, off by {off[name]:.2f} m")
    back = camera.spaceFromGPS(np.array([pymap3d.enu2geodetic(*metres, *AT, 0.0)]))[0]
    print(f"  and back from the ellipsoid's: {np.asarray(back)[:2].round(2)} m")
assert 3.0 < off["east"] < 3.4
assert 0.5 < off["north"] < 0.8
PYTHON
