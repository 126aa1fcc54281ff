# SPDX-License-Identifier: MIT
"""Cross3DReg and GeoTransformer in one network, whose parts a configuration switches on."""
