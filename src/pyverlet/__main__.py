"""`python -m pyverlet` is the same as `pyverlet`."""

from __future__ import annotations

import sys

from pyverlet.cli import main

if __name__ == "__main__":
    sys.exit(main())
