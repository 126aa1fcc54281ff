# SPDX-License-Identifier: MIT
"""Stages without training: matching, pose estimation and refinement, one file each."""
