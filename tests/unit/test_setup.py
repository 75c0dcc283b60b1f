"""Messages of `make demo` on machines where something is missing."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout with nothing set up."""
    (tmp_path / "scripts").mkdir()
    shutil.copy(ROOT / "scripts/setup.sh", tmp_path / "scripts")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def set_up(checkout: Path, *arguments: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", str(checkout / "scripts/setup.sh"), *arguments],
        check=False,
        env=os.environ | env,
        capture_output=True,
        text=True,
        timeout=100,
        stdin=subprocess.DEVNULL,
    )


def test_no_such_python(checkout: Path) -> None:
    done = set_up(checkout, "demo", PYTHON="python-that-is-not-there")
    assert done.returncode == 1
    assert "there is no python-that-is-not-there" in done.stderr
    assert "install Python 3.10 or newer" in done.stderr


def test_unknown_purpose(checkout: Path) -> None:
    done = set_up(checkout, "fly")
    assert done.returncode == 1
    assert "use: scripts/setup.sh demo|rviz-demo|dev|test" in done.stderr


def test_no_network(checkout: Path) -> None:
    no_network = {
        "PYTHON": "/usr/bin/python3",
        "PIP_INDEX_URL": "http://127.0.0.1:9/simple",
        "PIP_RETRIES": "0",
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_EXTRA_INDEX_URL": "",
        "PIP_FIND_LINKS": "",
    }
    done = set_up(checkout, "dev", **no_network)
    assert done.returncode == 1
    assert "installing Python packages into .venv (rosglass[dev]" in done.stdout
    assert "PyPI could not be reached" in done.stderr
    assert "run this again" in done.stderr
    assert not (checkout / ".venv/.rosglass").exists()


@pytest.mark.parametrize("target", ["lint", "types", "docs", "wheel"])
def test_make_sets_up_what_it_needs(checkout: Path, target: str) -> None:
    """Nothing of a target runs before its set-up has succeeded."""
    shutil.copy(ROOT / "Makefile", checkout)
    script = checkout / "scripts/setup.sh"
    script.write_text('echo "asked for $*"; exit 1\n')
    script.chmod(0o755)
    # `make test` runs this test: its variables for nested makes are not for this one.
    outside = {name: text for name, text in os.environ.items() if not name.startswith("MAKE")}
    done = subprocess.run(
        ["make", target],
        check=False,
        cwd=checkout,
        env=outside,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.stdout == "asked for dev\n"
    (line,) = done.stderr.splitlines()
    assert line.endswith("dev] Error 1")


def test_extras_installed_by_the_readme_suffice_for_its_commands() -> None:
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (cockpit,) = re.findall(r'^cockpit = \["rosglass\[(.*)\]"\]', project, re.MULTILINE)
    assert {"zenoh", "dds", "qml", "camera", "bags"} <= set(cockpit.split(","))
