#!/usr/bin/env bash
# xradar 0.12.0's `georeference()` gives the gates of a radar as x, y and z, and so does Py-ART 2.3.0 as `gate_x`, `gate_y` and
# `gate_z`. x and y have their origin at the radar in both. z has it there in Py-ART alone; in xradar it is the height above
# the sea, so that the clouds of one file lie apart by the altitude of the radar, and the origin of xradar's is no place where
# anything stood. What it says of its z (`long_name`, `standard_name`) are the words for the range. x and y differ by metres.
#
# Guess before it was run: one file, one cloud; the radar stands at the origin of all three axes.
# For whom it matters: whoever brings scans of a weather or wildlife radar together with a height model or a LiDAR: half of
# the pipelines must add the altitude, and half must not; and whoever takes the origin for the sensor, in free-space tests.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "xradar==0.12.0" "arm-pyart==2.3.0" "numpy<2.5"
cd "$folder"
HOME="$folder" PYART_QUIET=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyart
import xradar

radar = pyart.testing.make_empty_ppi_radar(100, 360, 1)
radar.altitude["data"][:] = 500.0
radar.range["data"] = np.linspace(100.0, 40000.0, 100)
radar.add_field("reflectivity", {"data": np.ma.ones((360, 100))})
pyart.io.write_cfradial("radar.nc", radar)

first = pyart.io.read_cfradial("radar.nc")
gates = np.stack([first.gate_x["data"], first.gate_y["data"], first.gate_z["data"]], axis=-1)
sweep = xradar.io.open_cfradial1_datatree("radar.nc").xradar.georeference()["sweep_0"].ds
theirs = np.stack([sweep[axis].values for axis in "xyz"], axis=-1)
order = np.argsort(sweep["azimuth"].values), np.argsort(first.azimuth["data"])
apart = theirs[order[0]] - gates[order[1]]

print("xradar", version("xradar"), "arm-pyart", version("arm-pyart"), "numpy", np.__version__)
print("  the radar stands 500 m above the sea; its nearest gate lies 100 m away")
print(f"  z of the nearest gates: Py-ART {gates[:, 0, 2].mean():.1f} m, xradar {theirs[:, 0, 2].mean():.1f} m")
print(f"  z apart by {apart[..., 2].min():.1f} to {apart[..., 2].max():.1f} m, x and y by up to {np.abs(apart[..., :2]).max():.1f} m")
print("  xradar's z says:", sweep["z"].attrs.get("long_name"))
assert np.allclose(apart[..., 2], 500.0, atol=1.0), "Py-ART and xradar now have one origin of z"
assert np.abs(apart[..., :2]).max() < 10.0, "x and y are no longer the same"
print("heights begin at the sea")
PYTHON
