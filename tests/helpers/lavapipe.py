"""Mesa's Vulkan on the processor, which needs no graphics card."""

from __future__ import annotations

from pathlib import Path

import pytest

_DRIVERS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")


def lavapipe() -> str:
    """Return the file that names lavapipe to Vulkan's loader; skip the test if there is none."""
    for folder in _DRIVERS:
        for file in sorted(Path(folder).glob("lvp_icd*.json")):
            return str(file)
    pytest.skip("Mesa's Vulkan is not installed: sudo apt-get install mesa-vulkan-drivers")
