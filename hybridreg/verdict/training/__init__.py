# SPDX-License-Identifier: MIT
"""How the numbers behind the verdict were fitted, and how they are checked."""
