"""Run the command as ``python -m rosglass.cli``."""

import sys

from rosglass.cli import main

sys.exit(main())
