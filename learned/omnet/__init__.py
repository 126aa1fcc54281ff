# SPDX-License-Identifier: MIT
"""OMNet (Xu et al. 2021): the pose regressed in iterations on the predicted overlap."""
