# SPDX-License-Identifier: MIT
"""Layers that several networks share: KPConv, sparse convolution, attention, normalisation, positions."""
