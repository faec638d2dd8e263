"""Run the command line by ``python -m wearsim``."""

from __future__ import annotations

import sys

from wearsim.cli import main

if __name__ == "__main__":
    sys.exit(main())
