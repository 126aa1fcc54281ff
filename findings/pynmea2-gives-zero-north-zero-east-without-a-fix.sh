#!/usr/bin/env bash
# pynmea2 1.19.0 gives the latitude 0.0 and the longitude 0.0 for a sentence whose position is empty, as receivers send it
# until they have a fix: a place in the Gulf of Guinea, and a number like any other. `altitude` is None there.
#
# Guess before it was run: None or NaN, as for the altitude.
# For whom it matters: whoever takes the start of a registration, or the poses of a drive, from a receiver's log: averaged or
# interpolated with others, such rows put a scan thousands of kilometres away. Look at `gps_qual` of GGA (0: no fix) and `status`
# of RMC ("V": void) first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pynmea2==1.19.0"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import pynmea2


def sentence(body: str) -> str:
    checksum = 0
    for letter in body:
        checksum ^= ord(letter)
    return f"${body}*{checksum:02X}"


print("pynmea2", version("pynmea2"))
fix = pynmea2.parse(sentence("GPGGA,101500.00,5200.6000,N,01300.6000,E,1,08,0.9,100.0,M,46.9,M,,"), check=True)
print("with a fix:", round(fix.latitude, 4), round(fix.longitude, 4), fix.altitude, "quality", fix.gps_qual)
assert abs(fix.latitude - 52.01) < 1e-9
for body in ("GPGGA,101459.00,,,,,0,00,99.99,,,,,,", "GNRMC,101459.00,V,,,,,,,011226,,,N"):
    none = pynmea2.parse(sentence(body), check=True)
    told = none.gps_qual if body.startswith("GPGGA") else none.status
    print(f"{body[:5]} without one: {none.latitude!r} {none.longitude!r}, told by {told!r} alone")
    assert (none.latitude, none.longitude) == (0.0, 0.0), "a missing position is no number any more"
    if body.startswith("GPGGA"):
        assert none.altitude is None
PYTHON
