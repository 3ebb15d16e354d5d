"""`python -m rrru`, the same as the command `rrru`."""

import sys

from rrru.cli import main

sys.exit(main())
