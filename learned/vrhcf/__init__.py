# SPDX-License-Identifier: MIT
"""VRHCF's descriptor SphereNet and its matching (Zhao et al., ICME 2024); its estimator is `classical.hcf.hcf`."""
