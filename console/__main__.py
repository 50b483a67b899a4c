"""`python -m console`: the same as the `inhabit` command."""

import sys

from console.app import main

if __name__ == "__main__":
    sys.exit(main())
