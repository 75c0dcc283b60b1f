"""Runs the Python examples of a page of the documentation, as its reader would."""

from __future__ import annotations

import ast
import asyncio
import inspect
import re
import threading
from pathlib import Path
from typing import Any

import pytest
from waiting import eventually

import rosglass

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


class Reader:
    """Runs a page's examples from top to bottom, one statement after the other, as a reader would.

    What stands behind a statement counts: ``# 1.5`` is the value of an expression,
    ``# ConversionError: ...`` the error that it raises.

    Args:
        page: Path of the page.
        given: What a reader has before the page's first line.
        only: Number of the one block to run; None for the whole page.
    """

    def __init__(self, page: str, given: dict[str, Any], only: int | None = None) -> None:
        self.page, self.names, self._only = page, given, only
        self._loop = asyncio.new_event_loop()

    def read(self) -> int:
        """Run everything; returns how many statements there were."""
        text = (ROOT / self.page).read_text(encoding="utf-8")
        count = 0
        try:
            for number, block in enumerate(BLOCK.finditer(text)):
                if self._only not in {None, number}:
                    continue
                first = text.count("\n", 0, block.start(1))
                lines = block[1].splitlines()
                # As many empty lines before it as in the page, so that tracebacks name its lines.
                for statement in ast.parse("\n" * first + block[1]).body:
                    end = lines[(statement.end_lineno or 0) - 1 - first]
                    self._run(statement, end.partition("  # ")[2].strip())
                    count += 1
        finally:
            self._loop.close()
        return count

    def _run(self, statement: ast.stmt, remark: str) -> None:
        where = f"{self.page}:{statement.lineno}"
        error = re.match(r"(\w+Error): (.*)", remark)
        if error:
            with pytest.raises(
                getattr(rosglass, error[1]), match=re.escape(error[2].removeprefix("... "))
            ):
                self._evaluate(statement)
            return
        value = self._evaluate(statement)
        if not isinstance(statement, ast.Expr) or value is None:
            return
        try:
            expected = ast.literal_eval(remark)
        except (SyntaxError, ValueError):
            return
        if not _is(value, expected):  # what is known of the robot grows
            seen = [value]
            eventually(
                lambda: seen.append(self._evaluate(statement)) or _is(seen[-1], expected),
                lambda: f"{where}: {seen[-1]!r} is not {expected!r}",
            )

    def _evaluate(self, statement: ast.stmt) -> Any:
        flags = ast.PyCF_ALLOW_TOP_LEVEL_AWAIT
        tree: ast.Module | ast.Expression = ast.Module([statement], [])
        if isinstance(statement, ast.Expr):
            tree = ast.Expression(statement.value)
        mode = "eval" if isinstance(tree, ast.Expression) else "exec"
        if ast.unparse(statement) == "node.spin()":  # until Ctrl-C, or the node is closed
            threading.Timer(0.2, self.names["node"].close).start()
        code = compile(tree, self.page, mode, flags, dont_inherit=True)
        value = eval(code, self.names)  # the pages are ours
        if inspect.iscoroutine(value):
            return self._loop.run_until_complete(asyncio.wait_for(value, 20))
        return value


def _is(value: Any, shown: Any) -> bool:
    """Return True if a value is the one shown, which ends in three dots where it was too long."""
    if isinstance(shown, str) and shown.endswith("..."):
        return isinstance(value, str) and value.startswith(shown[:-3])
    return bool(value == shown)
