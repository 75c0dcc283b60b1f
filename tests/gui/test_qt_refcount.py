"""The Qt binding must not eat references: PySide6 6.12.0 on Python 3.11 takes one per call."""

from __future__ import annotations

import subprocess
import sys

import pytest

from rosglass.errors import UnsupportedError
from rosglass.qt import _refuse_broken_binding, choose_binding

pytestmark = pytest.mark.both_qt


def test_none_keeps_its_references(app) -> None:
    app.processEvents()
    before = sys.getrefcount(None)
    for _ in range(1000):
        app.processEvents()
    # Garbage of other tests may be freed at that time; the fault takes one per call.
    assert sys.getrefcount(None) - before > -500


def test_the_version_that_does_not_is_refused() -> None:
    if sys.version_info < (3, 12):
        with pytest.raises(UnsupportedError, match=r"6\.12\.0 corrupts .*PySide6-Essentials<6.12"):
            _refuse_broken_binding("PySide6", (6, 12, 0))
    else:
        _refuse_broken_binding("PySide6", (6, 12, 0))
    for old in ((6, 8, 0), (6, 10, 1)):
        with pytest.raises(UnsupportedError, match=r"old interface .*PySide6-Essentials>=6.11"):
            _refuse_broken_binding("PySide6", old)
    _refuse_broken_binding("PySide6", (6, 11, 0))
    _refuse_broken_binding("PySide2", (5, 15, 8))


@pytest.mark.parametrize(
    ("loaded", "wanted", "binding"),
    [
        (set(), "", "PySide6"),
        (set(), "pyside2", "PySide2"),
        (set(), "PySide6", "PySide6"),
        ({"PyQt5"}, "", "PySide2"),
        ({"PySide2", "PyQt5"}, "pyside2", "PySide2"),
        ({"PySide6"}, "", "PySide6"),
        ({"PyQt6"}, "pyside6", "PySide6"),
    ],
)
def test_choice(loaded: set, wanted: str, binding: str) -> None:
    assert choose_binding(frozenset(loaded), wanted) == binding


@pytest.mark.parametrize(
    ("loaded", "wanted", "reason"),
    [
        ({"PyQt5"}, "pyside6", "already uses PyQt5"),
        ({"PySide6"}, "pyside2", "already uses PySide6"),
        ({"PySide6", "PyQt5"}, "", "already uses PySide6"),
        (set(), "qt7", "must be pyside6 or pyside2"),
    ],
)
def test_a_second_qt_is_refused(loaded: set, wanted: str, reason: str) -> None:
    with pytest.raises(UnsupportedError, match=reason):
        choose_binding(frozenset(loaded), wanted)


def test_missing_qt5_is_reported_with_its_packages() -> None:
    script = """import os, sys
sys.modules["PySide2"] = None
os.environ["ROSGLASS_QT"] = "pyside2"
from rosglass.errors import UnsupportedError
try:
    import rosglass.qt
except UnsupportedError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "apt install python3-pyside2.qtquick" in done.stdout
