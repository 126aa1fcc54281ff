# SPDX-License-Identifier: MIT
"""RoITr: rotation-invariant transformer for point cloud matching (Yu et al., CVPR 2023)."""
