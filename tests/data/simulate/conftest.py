# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import pytest

from hybridreg.data.simulate import SENSORS, Drawn, Sensor, draw

# Real patterns with a tenth of the pulses: tests stay fast, every line of code runs.
THIN_FAN = replace(SENSORS["mems-fan"], points=9_000)
THIN_RINGS = replace(SENSORS["hdl64e"], points=64 * 250)


@pytest.fixture(scope="session")
def thin_sensors() -> tuple[Sensor, Sensor]:
    return THIN_FAN, THIN_RINGS


@pytest.fixture(scope="session")
def mid_pair() -> Drawn:
    return draw("mid", 11, THIN_FAN, THIN_RINGS)
