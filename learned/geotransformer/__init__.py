# SPDX-License-Identifier: MIT
"""The parts that are GeoTransformer's own (Qin et al. 2022)."""
