"""Everything in our QML modules is given values made to hurt: nothing crashes, hangs or raises.

Each chunk runs in a process of its own, since a crash is what it looks for.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from ports import free_port

if TYPE_CHECKING:
    from collections.abc import Iterator

PROGRAM = Path(__file__).with_name("fuzz_app.py")
#: Seconds that a chunk may take; a call that hangs ends its process after 10.
LIMIT = 600
pytestmark = pytest.mark.timeout(LIMIT + 30)
CHUNKS = ["singletons", "given", "types", "lifecycle"]
#: The cases that run in both versions of Qt: values that are given, and objects that go away.
IN_BOTH = {("given", "Ros2"), ("lifecycle", "Ros2")}


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    from rosglass.wires.zenoh.router import Router

    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        yield router.url


def drive(chunk: str, uri: str, url: str, platform: dict[str, str], folder: Path) -> None:
    last = folder / "last"
    environment = os.environ | platform | {"PYTHONFAULTHANDLER": "1"}
    with (folder / "output").open("wb") as output:
        # A file, not a pipe: what it says takes megabytes.
        done = subprocess.run(
            [sys.executable, str(PROGRAM), chunk, uri, url, str(last)],
            cwd=folder,
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            timeout=LIMIT,
            check=False,
        )
    text = (folder / "output").read_text(errors="replace")
    tried = last.read_text(errors="replace").strip() if last.exists() else "nothing yet"
    lines = text.splitlines()
    end = "\n".join(line[:300] for line in lines[-40:])
    assert done.returncode == 0, f"{chunk} of {uri} ended at {tried}:\n{end}"
    assert "came to the end" in text, f"{chunk} of {uri} ended at {tried}:\n{end}"
    for sign in ("Traceback (most recent", "internal error", "RuntimeWarning"):
        at = next((number for number, line in enumerate(lines) if sign in line), None)
        found = "" if at is None else "\n".join(line[:300] for line in lines[at : at + 15])
        assert not found, f"{chunk} of {uri} says:\n{found}"


@pytest.mark.parametrize(
    ("chunk", "uri"),
    [
        pytest.param(
            chunk,
            uri,
            marks=[pytest.mark.both_qt] if (chunk, uri) in IN_BOTH else [],
            id=f"{chunk}-{uri}",
        )
        for chunk in CHUNKS
        for uri in ("Ros", "Ros2")
    ],
)
def test_nothing_crashes_hangs_or_raises(
    chunk: str, uri: str, platform: dict[str, str], tmp_path: Path
) -> None:
    drive(chunk, uri, "memory", platform, tmp_path)


def test_nothing_crashes_hangs_or_raises_with_a_robot(
    router: str, platform: dict[str, str], tmp_path: Path
) -> None:
    drive("lifecycle", "Ros2", router, platform, tmp_path)
