"""Prints what scripts/test.sh ends with: a line for each group, and pytest's closing line for all.

Reads a line for each group, its fields apart by tabs: seconds, exit code, name, and the last line
that it printed. Exits with 1 if a group failed.
"""

from __future__ import annotations

import datetime
import re
import sys
from collections import Counter

#: The outcomes in pytest's closing line, in its order.
_OUTCOMES = [
    *("failed", "passed", "skipped", "deselected", "xfailed", "xpassed", "warnings", "errors"),
    "rerun",
]
#: Singular forms of these.
_PLURALS = {"warning": "warnings", "error": "errors"}
_CLOSING_LINE = re.compile(r"(?:=+ )?((?:\d+ [a-z]+(?:, )?)+) in [\d.]+s(?: \([\d:]+\))?(?: =+)?")


def outcomes(line: str) -> Counter[str]:
    """Return the numbers of a closing line of pytest by outcome; none for any other line."""
    found: Counter[str] = Counter()
    if closing := _CLOSING_LINE.fullmatch(line):
        for part in closing[1].split(", "):
            number, outcome = part.split()
            found[_PLURALS.get(outcome, outcome)] += int(number)
    return found


def closing_line(total: Counter[str], seconds: int) -> str:
    """Return a closing line as ``pytest -q`` prints it."""
    names = [*_OUTCOMES, *sorted(total.keys() - set(_OUTCOMES))]
    singular = {plural: one for one, plural in _PLURALS.items()}
    parts = [
        f"{total[name]} {singular.get(name, name) if total[name] == 1 else name}"
        for name in names
        if total[name]
    ]
    duration = f" ({datetime.timedelta(seconds=seconds)})" if seconds >= 60 else ""
    return f"{', '.join(parts) or 'no tests ran'} in {seconds:.2f}s{duration}"


def main() -> int:
    total: Counter[str] = Counter()
    print("==> seconds of each group")
    for row in sys.stdin:
        seconds, code, name, last = row.rstrip("\n").split("\t", 3)
        found = outcomes(last)
        # A check without tests, and a group whose processes crashed, count as an error.
        if code != "0" and not found["failed"] + found["errors"]:
            found["errors"] += 1
        total += found
        result = (
            last if outcomes(last) or last.startswith(("no tests ran", "not run")) else "passed"
        )
        if code != "0":
            result = f"FAILED, exit code {code}: {last}"
        print(f"{seconds:>5}  {name}: {result}")
    print(closing_line(total, int(sys.argv[1])))
    return 1 if total["failed"] + total["errors"] else 0


if __name__ == "__main__":
    sys.exit(main())
