# SPDX-License-Identifier: MIT
"""Write hybridreg/io/coordinate_systems/epsg_lengths.json: `python -m tools.epsg_table`, with pyproj installed."""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

OUT = Path(__file__).parents[1] / "hybridreg/io/coordinate_systems/epsg_lengths.json"
KINDS = ("PROJECTED_CRS", "VERTICAL_CRS")
LARGEST = 32_767  # codes of users begin there, in GeoTIFF's keys


def lengths() -> dict[int, float]:
    """Metres of each system's unit, by its code."""
    from pyproj import CRS
    from pyproj.database import query_crs_info

    rows = [row for kind in KINDS for row in query_crs_info("EPSG", kind, allow_deprecated=True)]
    codes = sorted(code for row in rows if (code := int(row.code)) < LARGEST)
    units = {code: {axis.unit_conversion_factor for axis in CRS.from_epsg(code).axis_info} for code in codes}
    return {code: each.pop() for code, each in units.items() if len(each) == 1}


def runs(found: dict[int, float]) -> dict[str, list[list[int]]]:
    """First and last of codes that follow one another, by their unit."""
    by_unit: dict[str, list[list[int]]] = defaultdict(list)
    for code, metres in found.items():
        rows = by_unit[repr(metres)]
        if rows and rows[-1][1] == code - 1:
            rows[-1][1] = code
        else:
            rows.append([code, code])
    return dict(by_unit)


def main() -> None:
    from pyproj.database import get_database_metadata

    source = f"EPSG dataset {get_database_metadata('EPSG.VERSION')}"
    units = ",\n".join(f'"{unit}": {json.dumps(rows)}' for unit, rows in runs(lengths()).items())
    OUT.write_text(f'{{"source": "{source}", "metres": {{\n{units}\n}}}}\n')


if __name__ == "__main__":
    main()
