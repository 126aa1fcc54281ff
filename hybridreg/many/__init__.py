# SPDX-License-Identifier: MIT
"""Many clouds: against one prepared target, in a batch, or all into one frame."""
