# SPDX-License-Identifier: MIT
"""Predator (Huang et al. 2021): features, overlap and saliency of a pair's points."""
