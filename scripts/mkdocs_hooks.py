"""Links the Sphinx roles in docstrings (``:class:`Node```), which mkdocstrings does not know."""

from __future__ import annotations

import re
from typing import Any

_ROLE = re.compile(r":(?:attr|class|data|exc|func|meth|mod|obj):<code>(~?)([\w.]+)</code>")


def _link(found: re.Match[str]) -> str:
    short, name = found.groups()
    shown = name.rpartition(".")[2] if short else name
    return f'<autoref optional identifier="{name}"><code>{shown}</code></autoref>'


def on_page_content(html: str, **_: Any) -> str:
    return _ROLE.sub(_link, html)
