# SPDX-License-Identifier: MIT
"""What loaders share: lists of pairs, trajectories, and the locations of files."""
