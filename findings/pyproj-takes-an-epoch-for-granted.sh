#!/usr/bin/env bash
# pyproj 3.7.2 transforms between a frame in which the continents move (ITRF2014, as satellite services give positions)
# and one that is tied to a plate (ETRS89's frames, as European surveys are) by an operation that depends on time. Without
# a fourth coordinate `transform` takes the reference epoch of the operation, 2010, and says nothing: a reading of 2026
# comes out four decimetres beside where it does with its date. By "EPSG:4326", which many call the first, there is no
# shift at all, nearly a metre beside it.
#
# Guess before it was run: a transformation that needs a time asks for it, by an error or a warning.
# For whom it matters: whoever brings clouds or trajectories of a receiver into a survey's frame and then looks for
# decimetres in the registration. Give the decimal year as `transform(x, y, z, t)`, and name the frame that was measured in.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyproj==3.7.2"
cd "$folder"
HOME="$folder" PROJ_NETWORK=OFF "$folder/env/bin/python" - <<'PYTHON'
import warnings

import pyproj
from pyproj import Geod, Transformer

warnings.simplefilter("error")
place = (9.0, 48.0, 400.0)
measured = Transformer.from_crs("EPSG:7912", "EPSG:7931", always_xy=True)  # ITRF2014 to ETRF2000, both with heights
by_name = Transformer.from_crs("EPSG:4326", "EPSG:4258", always_xy=True)  # WGS 84 to ETRS89
dated = measured.transform(*place, 2026.0, errcheck=True)
earth = Geod(ellps="GRS80")
found = {
    "with the date, 2026": dated[:3],
    "with 2010": measured.transform(*place, 2010.0, errcheck=True)[:3],
    "without a date": measured.transform(*place, errcheck=True),
    'as "EPSG:4326" to "EPSG:4258"': by_name.transform(*place, errcheck=True),
}
print("pyproj", pyproj.__version__, "PROJ", pyproj.proj_version_str)
off = {}
for how, (longitude, latitude, _) in found.items():
    off[how] = earth.inv(dated[0], dated[1], longitude, latitude)[2]
    print(f"  {how}: {longitude:.8f}, {latitude:.8f}: {off[how]:.3f} m beside the first")
assert found["without a date"] == found["with 2010"], "pyproj no longer does this"
assert 0.3 < off["without a date"] < 0.5 and 0.7 < off['as "EPSG:4326" to "EPSG:4258"'] < 1.0, "the shifts have changed"
print("what was measured today is moved as if it were 2010")
PYTHON
