# SPDX-License-Identifier: MIT
"""FCGF (Choy et al. 2019): a feature for every voxel from sparse convolutions."""
