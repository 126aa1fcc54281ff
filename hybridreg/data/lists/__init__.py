# SPDX-License-Identifier: MIT
"""What loaders share: lists of pairs, trajectories, and where the files lie."""
