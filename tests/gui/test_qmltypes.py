"""Type descriptions of the QML modules for editors and qmllint."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from rosglass.qml import IMPORT_PATHS
from rosglass.qt import QT6

if not QT6:
    pytest.skip("the tools for editors come with PySide6", allow_module_level=True)

ROOT = Path(__file__).parents[2]
FOLDERS = [option for path in IMPORT_PATHS for option in ("-I", str(path))]
#: Warnings of qmllint about types and members that it does not know; the others are about style.
UNKNOWN = {
    "import",
    "incompatible-type",
    "missing-property",
    "missing-type",
    "signal-handler-parameters",
    "unresolved-type",
}


def tool(name: str) -> str:
    import PySide6

    return str(Path(PySide6.__file__).with_name(name))


def lint(*files: Path) -> list[str]:
    """Return which types, and which members of ours, qmllint does not know in files."""
    command = [tool("qmllint"), "--ignore-settings", "--json", "-", *FOLDERS, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return [
        f"{Path(file['filename']).name}:{found.get('line', 0)}: {found['message']} [{found['id']}]"
        for file in json.loads(done.stdout)["files"]
        for found in file["warnings"]
        if found["id"] in UNKNOWN and 'on type "QQuick' not in found["message"]
    ]


def test_the_descriptions_are_those_of_the_types() -> None:
    # In a process of its own: others' uses of the types change what they say of themselves.
    command = [sys.executable, str(ROOT / "scripts" / "qmltypes.py")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_qmllint_knows_all_that_the_examples_use() -> None:
    assert lint(*sorted((ROOT / "examples").rglob("*.qml"))) == []


@pytest.mark.parametrize("module", ["Ros", "Ros2"])
def test_our_own_files_are_clean(module: str) -> None:
    assert lint(*sorted((IMPORT_PATHS[0] / module).glob("*.qml"))) == []


def test_qmllint_finds_what_does_not_exist(tmp_path: Path) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(
        """import QtQuick 2.15
import Ros2 1.0
Item {
    Subscription { id: feed; topic: "/x"; nonsense: 3; onNewMessage: (m) => console.log(m.data) }
    property string text: feed.topic + feed.noSuchThing + Ros2.getName() + Ros2.noSuchCall()
    property int level: Ros2LoggerLevel.Warn
}"""
    )
    found = lint(file)
    assert len(found) == 3, found
    assert "4: " in found[0]
    assert "nonsense" in found[0]
    assert "noSuchThing" in found[1]
    assert "noSuchCall" in found[2]


def test_qmllint_knows_the_3d_view(tmp_path: Path) -> None:
    file = tmp_path / "Main.qml"
    file.write_text(
        """import QtQuick
import RosScene 1.0
Item {
    SceneView {
        id: scene
        anchors.fill: parent
        fixedFrame: "map"; view: "FPS"; tool: "Measure"
        background: "black"
        GridDisplay { cellSize: 2; color: "red" }
        PointCloud2Display { topic: "/points"; decayTime: 2 }
        RobotModelDisplay { }
        InteractiveMarkersDisplay { onMenuRequested: (entries, x, y) => console.log(x, y) }
        CameraDisplay { id: camera; hiddenDisplays: ["TF"] }
        ViewControllerDisplay { trackedFrame: "base_link"; mode2D: true }
        SetGoalTool { topic: "/goal"; onPoseSet: (x, y, yaw) => console.log(yaw) }
        Tool { name: "Mark"; onReleased: event => console.log(event.point) }
        SceneOverlay { source: "Over.qml"; watch: true }
        onCameraChanged: console.log(statusText, problem)
    }
    ImagePanel { display: camera; width: 640 }
    DisplaysPanel { view: scene }
    ViewsPanel { view: scene }
    ToolsPanel { view: scene }
    SelectionPanel { view: scene }
    ImagePanels { view: scene }
    Component.onCompleted: scene.reset()
    property string text: scene.noSuchThing
    GridDisplay { cellSizes: 3 }
    SphereDisplay { }
}"""
    )
    found = lint(file)
    assert len(found) == 3, found
    text = "\n".join(sorted(found))
    for wrong in ("noSuchThing", "cellSizes", "SphereDisplay"):
        assert wrong in text


def test_the_panels_of_the_3d_view_are_known() -> None:
    panels = IMPORT_PATHS[0].parents[1] / "scene" / "app" / "panels"
    known = (IMPORT_PATHS[1] / "RosScene" / "qmldir").read_text()
    # Those that are parts of others, and of the program's window.
    hidden = {
        "ColorChooser.qml",
        "PlainComboBox.qml",
        "PlainToolTip.qml",
        "SettingEditor.qml",
        "View.qml",
        "WindowPanels.qml",
    }
    assert {file.name for file in panels.glob("*.qml") if file.name not in known} == hidden


class LanguageServer:
    """Speaks the Language Server Protocol with qmlls."""

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen(
            [tool("qmlls")],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={k: v for k, v in os.environ.items() if "IMPORT_PATH" not in k},
        )
        self._watchdog = threading.Timer(60, self._process.kill)
        self._watchdog.start()
        settings = {"processId": None, "rootUri": folder.as_uri(), "capabilities": {}}
        self.send("initialize", settings, id=1)
        self.receive()
        self.send("initialized", {})

    def send(self, method: str, params: Any, **more: Any) -> None:
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **more}).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self._process.stdin.flush()

    def receive(self) -> Any:
        output: Any = self._process.stdout
        length = 0
        while line := output.readline().strip():
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        assert length, "the language server has ended"
        return json.loads(output.read(length))

    def diagnose(self, file: Path) -> list[str]:
        document = {"uri": file.as_uri(), "languageId": "qml", "version": 1}
        self.send("textDocument/didOpen", {"textDocument": {**document, "text": file.read_text()}})
        while True:
            message = self.receive()
            found = message.get("params", {}).get("diagnostics")
            # The first is said before modules were read.
            if message.get("method") == "textDocument/publishDiagnostics" and found:
                return [item["message"] for item in found]

    def close(self) -> None:
        self._watchdog.cancel()
        self._process.kill()
        self._process.communicate()


def test_an_editor_knows_the_types(tmp_path: Path) -> None:
    settings = tmp_path / ".qmlls.ini"
    settings.write_text("[General]\nbuildDir=/somewhere\nimportPaths=/elsewhere\n")
    command = [sys.executable, "-m", "rosglass.cli", "qml-path", "--qmlls-ini"]
    for _ in range(2):
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert done.stdout == f"wrote {settings}\n"
    wanted = os.pathsep.join(map(str, ["/elsewhere", *IMPORT_PATHS]))
    assert f'importPaths="{wanted}"\n' in settings.read_text()
    assert "buildDir=/somewhere\n" in settings.read_text()
    settings.write_text(settings.read_text().replace("buildDir=/somewhere\n", ""))
    file = tmp_path / "Main.qml"
    file.write_text('import Ros2 1.0\nSubscription { topic: "/x"; nonsense: 3 }')
    server = LanguageServer(tmp_path)
    try:
        found = server.diagnose(file)
    finally:
        server.close()
    assert len(found) == 1, found
    assert 'Could not find property "nonsense"' in found[0]


def test_the_import_path_is_printed() -> None:
    command = [sys.executable, "-m", "rosglass.cli", "qml-path"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.strip().split(os.pathsep) == list(map(str, IMPORT_PATHS))


def test_invalid_settings_are_left_alone(tmp_path: Path) -> None:
    settings = tmp_path / ".qmlls.ini"
    settings.write_text("what is this")
    command = [sys.executable, "-m", "rosglass.cli", "qml-path", "--qmlls-ini"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "mend or delete it first" in done.stderr
    assert settings.read_text() == "what is this"
