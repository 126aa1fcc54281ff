# SPDX-License-Identifier: MIT
"""Sensors that scan a simulated scene, and the camera."""
