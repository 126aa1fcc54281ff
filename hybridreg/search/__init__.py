# SPDX-License-Identifier: MIT
"""From one rough pose to the best supported ones about it, and to those that look alike."""
