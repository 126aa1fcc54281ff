# SPDX-License-Identifier: MIT
"""Arrays in, arrays out: nothing here knows a scene or a stage."""
