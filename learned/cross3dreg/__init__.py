# SPDX-License-Identifier: MIT
"""Cross3DReg and GeoTransformer in one network; the configuration switches its parts on."""
