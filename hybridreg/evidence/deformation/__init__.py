# SPDX-License-Identifier: MIT
"""Does a cloud fit better when it is deformed? No rigid pose is right then."""
