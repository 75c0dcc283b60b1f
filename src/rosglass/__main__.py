"""Run the command as ``python -m rosglass``."""

import sys

from rosglass.cli import main

sys.exit(main())
