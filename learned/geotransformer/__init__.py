# SPDX-License-Identifier: MIT
"""The parts specific to GeoTransformer (Qin et al. 2022)."""
