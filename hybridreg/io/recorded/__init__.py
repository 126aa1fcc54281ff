# SPDX-License-Identifier: MIT
"""Files of devices, recorders and design tools: several clouds in one, each with where it was seen from."""
