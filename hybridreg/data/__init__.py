# SPDX-License-Identifier: MIT
"""Datasets: the simulator and the loaders."""
