"""Which renderer draws the overlays of a program: one for all, chosen for the first of them."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import Error

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

PLAIN = 'Item { Rectangle { x: 40; y: 30; width: 100; height: 60; color: "#0080ff" } }'
SHADER = 'ShaderEffect { fragmentShader: "void main() { gl_FragColor = vec4(1.0); }" }'
LATER = """Item {
    id: root
    Timer { running: true; interval: 300; onTriggered: Qt.createQmlObject(
        'import QtQuick 2.15; Shader' + 'Effect { width: 9; height: 9 }', root) }
}"""
CONFIG = """Visualization Manager:
  Displays:
    - {Class: rosglass/QmlOverlay, Enabled: true, Name: Plain, Path: %s}
    - {Class: rosglass/QmlOverlay, Enabled: true, Name: Shader, Path: %s}
"""


@pytest.fixture
def qml(tmp_path: Path) -> Callable[..., Path]:
    def write(name: str, text: str, imports: str = "") -> Path:
        file = tmp_path / f"{name}.qml"
        file.write_text(f"import QtQuick 2.15\n{imports}\n{text}\n")
        return file

    return write


@pytest.fixture
def chosen(screen: str, master: str, tmp_path: Path) -> Callable[..., str]:
    """Show overlays in a separate RViz; return the log messages about the renderer."""

    def run(*arguments: Any, **env: str) -> str:
        picture = tmp_path / "picture.png"
        command = [sys.executable, "-m", "rosglass.cli", "-v", "rviz", *map(str, arguments)]
        given = {"PATH": os.environ["PATH"], "DISPLAY": screen, "HOME": str(tmp_path)}
        given |= {"XDG_RUNTIME_DIR": str(tmp_path), "ROS_MASTER_URI": master, "ROS_IP": "127.0.0.1"}
        done = subprocess.run(
            [*command, "--screenshot", str(picture), "--after", "2"],
            env=given | env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stdout
        assert picture.exists()
        said = [line for line in done.stdout.splitlines() if " drawn" in line]
        assert sum("INFO" in line for line in said) == 1
        return "\n".join(said)

    return run


def test_without_a_graphics_card_the_software_renderer_draws(
    qml: Any, chosen: Callable[..., str]
) -> None:
    said = chosen("--overlay", qml("Plain", PLAIN))
    assert "overlays are drawn by Qt's software renderer: no graphics card" in said
    assert "llvmpipe" in said
    assert "not drawn" not in said


def test_screenshots_do_not_decide_before_the_files_are_read(
    qml: Any, chosen: Callable[..., str], tmp_path: Path
) -> None:
    (tmp_path / "dot.ppm").write_text("P3 1 1 255 255 0 0")
    # Qt takes a renderer for good when it makes the first of these, before any window.
    both = 'Item { Image { source: "dot.ppm" } ComboBox { model: 3 } Window { } }'
    file = qml("Picture", both, "import QtQuick.Controls 2.15\nimport QtQuick.Window 2.15")
    assert "overlays are drawn by Qt's software renderer: no graphics" in chosen("--overlay", file)


def test_an_overlay_that_needs_opengl_has_it_for_all(qml: Any, chosen: Callable[..., str]) -> None:
    shader = qml("Shader", f"Item {{ {SHADER} }}")
    said = chosen("--overlay", qml("Plain", PLAIN), "--overlay", shader)
    assert f"overlays are drawn by OpenGL: {shader}:3: ShaderEffect needs it" in said


def test_an_overlay_of_the_config_that_needs_opengl_has_it_for_all(
    qml: Any, chosen: Callable[..., str], tmp_path: Path
) -> None:
    shader = qml("Shader", f"Item {{ {SHADER} }}")
    config = tmp_path / "test.rviz"
    config.write_text(CONFIG % (qml("Plain", PLAIN), shader))
    assert f"by OpenGL: {shader}:3: ShaderEffect" in chosen(config)


@pytest.mark.parametrize("late", [False, True])
def test_undrawable_items_are_reported_with_place_and_fix(
    late: bool, qml: Any, chosen: Callable[..., str]
) -> None:
    shader = qml("Shader", LATER if late else f"Item {{ {SHADER} }}")
    said = chosen("--overlay", shader, **({} if late else {"QT_QUICK_BACKEND": "software"}))
    assert "overlays are drawn by Qt's software renderer" in said
    assert ("QT_QUICK_BACKEND=software" in said) == (not late)
    assert f"overlay Shader: {shader}{'' if late else ':3'}: ShaderEffect is not drawn" in said
    assert said.count("is not drawn") == 1
    assert "--renderer opengl" in said


def test_undrawable_videos_are_reported(qml: Any, chosen: Callable[..., str]) -> None:
    film = "Item { MediaPlayer { id: film } VideoOutput { source: film } }"
    file = qml("Film", film, "import QtMultimedia 5.15")
    said = chosen("--overlay", file, "--renderer", "software")
    assert f"overlay Film: {file}:3: MediaPlayer is not drawn" in said
    assert said.count("is not drawn") == 1


@pytest.mark.parametrize(("wanted", "name"), [("opengl", "OpenGL"), ("software", "Qt's software")])
def test_the_choice_of_the_user_takes_precedence(
    wanted: str, name: str, qml: Any, chosen: Callable[..., str]
) -> None:
    file = qml("Shader", f"Item {{ {SHADER} }}") if wanted == "software" else qml("Plain", PLAIN)
    other = {"QT_QUICK_BACKEND": "software"} if wanted == "opengl" else {}
    said = chosen("--overlay", file, "--renderer", wanted, **other)
    assert f"overlays are drawn by {name}" in said
    assert "it was requested" in said
    assert ("is not drawn" in said) == (wanted == "software")


def test_the_renderer_cannot_be_changed_later(
    app: Any, wait: Callable[..., None], qml: Any
) -> None:
    from rosglass.rviz.rendering import choice

    overlay = app.add_qml(qml("Plain", PLAIN))
    assert choice.renderer == "software"
    assert overlay.problem == ""
    choice.prefer("software")
    choice.prefer("auto")
    with pytest.raises(Error, match="has chosen software for all"):
        choice.prefer("opengl")
    with pytest.raises(Error, match="expected one of auto, opengl, software"):
        choice.prefer("vulkan")
    shader = app.add_qml(qml("Shader", f"Item {{ {SHADER} }}"))
    assert "ShaderEffect is not drawn" in shader.problem
    shader.file.write_text(f"import QtQuick 2.15\n{PLAIN}")
    shader.reload()
    assert shader.problem == ""


def test_a_graphics_card_is_used(monkeypatch: pytest.MonkeyPatch, app: Any) -> None:
    from rosglass.qml.run import renderer_choice as qml_choice
    from rosglass.rviz.rendering import OverlayRendererChoice

    monkeypatch.setattr(qml_choice, "taken_renderer", lambda: "")

    class Choice(OverlayRendererChoice):
        def _graphics_device(self) -> str:
            return "NVIDIA H200/PCIe/SSE2"

    made = Choice()
    assert made.choose([]) == "opengl"
    assert made.reason == "NVIDIA H200/PCIe/SSE2"


@pytest.mark.parametrize(
    ("text", "imports", "need"),
    [
        ("Item { }", "import QtGraphicalEffects 1.15", ":2: QtGraphicalEffects"),
        ("Item { }", "import QtQuick.Particles 2.15", ":2: QtQuick.Particles"),
        ("Item { Component { VideoOutput { } } }", "", ""),
        ("Item { MediaPlayer { } VideoOutput { } }", "", ":3: MediaPlayer"),
        ('Item { Loader { source: "Late.qml" } }', "", "Late.qml:3: ShaderEffect"),
        ("Item { Late { } }", "", "Late.qml:3: ShaderEffect"),
        ("Item { Glow { } }", "import Our.Looks 1.0", "Our/Looks/Shining.qml:2: ShaderEffect"),
        ("Item { Glow { } }", 'import "Our/Looks"', "Our/Looks/Shining.qml:2: ShaderEffect"),
        ("Item { Button { } }", "import Our.Looks 1.0", ""),
        ("Item { Button { } ComboBox { } }", "import QtQuick.Controls 2.15", ""),
        ("Item { // ShaderEffect { }\n/* VideoOutput { */ }", "", ""),
        ("Item { Image { layer.enabled: true } }", "", ":3: layer.enabled"),
        ("Item { layer { enabled: true } }", "", ":3: layer"),
        ("Item { ShaderEffectSource { } }", "", ":3: ShaderEffectSource"),
        ("Item { property int layer: 3 }", "", ""),
        ('Item { Text { text: "http://a/b" } }', "", ""),
    ],
)
def test_later_need_for_opengl_is_found_in_the_files(
    text: str, imports: str, need: str, qml: Any, app: Any, tmp_path: Path
) -> None:
    from rosglass.qml.run.renderer_choice import need_in_file
    from rosglass.qt import QtQml

    qml("Late", f"Item {{ {SHADER} }}")
    module = tmp_path / "Our" / "Looks"
    module.mkdir(parents=True)
    (module / "qmldir").write_text("module Our.Looks\nGlow 1.0 Shining.qml\n")
    (module / "Shining.qml").write_text(f"import QtQuick 2.15\n{SHADER}")
    places = [str(tmp_path), *QtQml.QQmlEngine().importPathList()]
    found = need_in_file(qml("Main", text, imports), places)
    assert found.endswith(need)
    assert bool(found) == bool(need)


def test_folders_that_import_each_other_are_looked_through_once(tmp_path: Path) -> None:
    from rosglass.qml.run.renderer_choice import need_in_file

    places = {"First": "Parts", "Second": "More Pages", "Third": "Looks"}
    imports = "".join(f'import "../{folder}"\n' for folder in places.values())
    files = {name: tmp_path / folder / f"{name}.qml" for name, folder in places.items()}
    for file in files.values():
        file.parent.mkdir()
        file.write_text(f"{imports}Item {{ First {{ }} Second {{ }} Third {{ }} }}")
    assert not need_in_file(files["First"], [])
    files["Second"].write_text(f"{imports}Item {{ First {{ }} {SHADER} }}")
    assert need_in_file(files["First"], []) == f"{files['Second']}:4: ShaderEffect"
