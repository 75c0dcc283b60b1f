"""Which of Qt's renderers draws a window: OpenGL only where it is fast, or needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Program

pytestmark = [pytest.mark.xvfb, pytest.mark.both_qt]

PLAIN = "import QtQuick 2.15\nRectangle { width: 200; height: 100 }\n"
SHADER = "import QtQuick 2.15\nItem { width: 200; height: 100; ShaderEffect { } }\n"


def shown(start: Callable[..., Program], screen: str, file: Path, *options: str, **env: str) -> Any:
    """Show a file until the renderer was chosen; returns the line of the log that says so."""
    program = start("run", file, *options, display=screen, **env)
    return program, program.until("are drawn by", 60)


@pytest.mark.parametrize(
    ("text", "options", "environment", "said"),
    [
        (PLAIN, (), {}, "by Qt's software renderer: no graphics card, OpenGL would be computed by"),
        (SHADER, (), {}, "by OpenGL: "),
        (PLAIN, ("--renderer", "opengl"), {"QT_QUICK_BACKEND": "software"}, "it was requested"),
        (SHADER, ("--renderer", "software"), {}, "by Qt's software renderer: it was requested"),
        (SHADER, (), {"QT_QUICK_BACKEND": "software"}, "renderer: QT_QUICK_BACKEND=software"),
        (PLAIN, (), {"QSG_RHI_BACKEND": "opengl"}, "by OpenGL: QSG_RHI_BACKEND=opengl"),
    ],
)
def test_opengl_is_chosen_where_it_is_fast_or_needed(
    text: str, options: Any, environment: Any, said: str, start: Any, screen: str, tmp_path: Path
) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(text)
    program, line = shown(start, screen, file, *options, **environment)
    assert said in line
    if text is SHADER and "software" in line:
        assert f"{file}:2: ShaderEffect is not drawn" in program.until("is not drawn")


def test_later_need_of_opengl_is_logged(start: Any, screen: str, tmp_path: Path) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(PLAIN)
    program, line = shown(start, screen, file, "--watch")
    assert "software" in line
    # The file is watched before the renderer is chosen.
    file.write_text(SHADER)
    assert "start with --renderer opengl" in program.until("is not drawn")


@pytest.mark.parametrize(
    ("what", "imports"),
    [("MediaPlayer", "import QtMultimedia 5.15"), ("ImagePublisher", "import Ros2 1.0")],
)
def test_non_visual_element_that_needs_opengl_is_logged(
    what: str, imports: str, start: Any, screen: str, tmp_path: Path
) -> None:
    from rosglass.qt import QT6

    if QT6 and what == "MediaPlayer":
        pytest.importorskip("PySide6.QtMultimedia", reason="needs the extra `camera`")
        imports = "import QtMultimedia"
    file = tmp_path / "Main.qml"
    file.write_text(
        f"import QtQuick 2.15\n{imports}\nItem {{ width: 200; height: 100\n{what} {{ }} }}\n"
    )
    program, _ = shown(start, screen, file, "--renderer", "software")
    assert f"{file}:4: {what} is not drawn" in program.until("is not drawn")


def test_a_thread_of_qt_is_not_made_to_wait_for_python(
    start: Any, screen: str, tmp_path: Path
) -> None:
    """Grabbing a window waits for its render thread, which must not wait for Python to paint."""
    file = tmp_path / "Main.qml"
    file.write_text(
        """import QtQuick 2.15
        import Ros2 1.0
        Item { width: 200; height: 100; ImageItem { anchors.fill: parent } }"""
    )
    picture = tmp_path / "picture.png"
    environment = {"QSG_RENDER_LOOP": "threaded"}
    program, _ = shown(start, screen, file, "--screenshot", str(picture), **environment)
    assert program.end(60) == 0
    assert picture.is_file()
