# SPDX-License-Identifier: MIT
"""Sensors that look at a simulated scene, and the camera."""
