# SPDX-License-Identifier: MIT
"""`python -m hybridreg.verdict.training`: gather answers, and fit the verdict's rules to them."""

from hybridreg.verdict.training.fit import main

if __name__ == "__main__":
    main()
