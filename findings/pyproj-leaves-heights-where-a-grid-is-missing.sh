#!/usr/bin/env bash
# pyproj 3.7.2 turns ellipsoidal heights into those of a vertical datum by a grid of the geoid. Its wheels hold no such
# grid and look for none on the network; then the easting and northing are transformed and the height is handed back as
# it was, nearly fifty metres off here, without a warning, also with `errcheck=True` and with `only_best=True`.
# `allow_ballpark=False` makes it raise, and `TransformerGroup(...).best_available` is False.
#
# Guess before it was run: without the grid the height is infinite, or an error or a warning names what is missing, at
# the latest where only the best is asked for.
# For whom it matters: whoever brings a cloud with heights of a satellite receiver (drone, vehicle) into the frame of a
# survey or of airborne data before a registration: the two then lie one geoid's height apart, which a search that is
# bounded to metres does not bridge. Pass `allow_ballpark=False`, and install the grid that is missing.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyproj==3.7.2"
cd "$folder"
HOME="$folder" PROJ_NETWORK=OFF "$folder/env/bin/python" - <<'PYTHON'
import warnings

import pyproj
from pyproj import Transformer
from pyproj.exceptions import ProjError
from pyproj.transformer import TransformerGroup

warnings.simplefilter("error")
print("pyproj", pyproj.__version__, "PROJ", pyproj.proj_version_str)
heights = {
    "EPSG:32632+5773": "UTM, EGM96",
    "EPSG:25832+7837": "UTM, DHHN2016 (Germany)",
    "EPSG:2056+5728": "LV95, LN02 (Switzerland)",
}
found = {}
for code, words in heights.items():
    for options in ({}, {"only_best": True}, {"allow_ballpark": False}):
        try:
            make = Transformer.from_crs("EPSG:4979", code, always_xy=True, **options)
            x, y, z = make.transform(8.5, 47.0, 500.0, errcheck=True)
            found[code, *options] = z
            print(f"  {words}, {options or 'no option'}: easting {x:.0f}, northing {y:.0f}, height {z}")
        except ProjError as error:
            found[code, *options] = None
            print(f"  {words}, {options}: ProjError: {str(error)[:60]}")
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    best = TransformerGroup("EPSG:4979", "EPSG:32632+5773", always_xy=True).best_available
print("  best_available:", best)
for (_, *options), z in found.items():
    assert z == (None if options == ["allow_ballpark"] else 500.0), "pyproj no longer does this"
assert not best, "the grid is there"
print("heights above the ellipsoid come back as heights above the sea, by number the same")
PYTHON
