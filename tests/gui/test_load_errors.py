"""Errors of files that cannot be loaded, with what to do about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.both_qt
@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("Batery", "did you mean Battery?"),
        ("CamerView", "did you mean CameraView?"),
        ("R.Batery", "did you mean Battery?"),
        ("Subscripton", "did you mean Subscription?"),
        ("Rectangl", "did you mean Rectangle?"),
        ("Conections", "did you mean Connections?"),
        ("Mypart", "did you mean MyPart?"),
        ("RowLayot", "did you mean RowLayout? It comes with: import QtQuick.Layouts 1.15"),
        ("Shpe", "did you mean Shape? It comes with: import QtQuick.Shapes 1.15"),
        ("Xyzzy", ""),
    ],
)
def test_misspelt_type_is_compared_with_those_of_the_imports(
    bench: Any, tmp_path: Path, written: str, hint: str
) -> None:
    from rosglass.errors import QmlError
    from rosglass.qml.run.live_file import LiveFile

    (tmp_path / "MyPart.qml").write_text("import QtQuick 2.15\nItem {}")
    file = tmp_path / "Screen.qml"
    file.write_text(
        "import QtQuick 2.15\nimport Ros2 1.0\nimport RosControls 1.0\n"
        f"import RosControls 1.0 as R\nItem {{ {written} {{}} }}"
    )
    with pytest.raises(QmlError) as caught:
        LiveFile(file, bench.session).create()
    assert str(caught.value) == f"{file}:5:8: {written} is not a type{hint and f'; {hint}'}"
