"""What holds for all tests."""

from __future__ import annotations

import os

# No test finds what robots told the developer's own programs, nor leaves anything there; the
# processes that tests start inherit this.
os.environ["ROSGLASS_TYPE_CACHE"] = "off"
