# SPDX-License-Identifier: MIT
"""`python -m hybridreg`, the same as the command `hybridreg`."""

from hybridreg.cli import main

if __name__ == "__main__":
    main()
