"""`python -m rrru`, the same as the command `rrru`."""

import sys

from rrru.cli import main

# other processes of the command load this module, too
if __name__ == "__main__":
    sys.exit(main())
