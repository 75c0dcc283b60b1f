"""Every example in QML runs as its reader starts it, beside a robot, and saves a screenshot."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from ports import free_port
from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from conftest import Bench

EXAMPLES = Path(__file__).parents[2] / "examples"
#: The simulated robot; its camera is slow, so that it leaves the processor to what is tested.
ROBOT = [sys.executable, "-m", "rosglass.cli", "robot", "--fps", "5"]
#: The paper's figures, and the programs that they are shown beside.
PARTNERS = {"figure4": "pose_prediction.py", "figure5": "humanoid.py"}
FILES = [
    file
    for pattern in ("*.qml", "ros1/*.qml", "paper/figure*.qml")
    for file in sorted(EXAMPLES.glob(pattern))
]


@pytest.fixture(scope="module")
def world() -> Iterator[str]:
    """A router and the simulated robot; gives the URL."""
    from rosglass.wires.zenoh.router import Router

    with Router(f"tcp/127.0.0.1:{free_port()}") as router:
        robot = subprocess.Popen(
            [*ROBOT, "--url", router.url, "--leash"],
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=sys.stderr,
        )
        assert robot.stdout is not None
        assert any("connected" in line for line in robot.stdout)
        yield router.url
        robot.kill()
        robot.wait(10)


@pytest.fixture
def partner(request: Any, world: str) -> Iterator[None]:
    """The program that an example needs besides the robot."""
    name = PARTNERS.get(request.getfixturevalue("file").stem)
    if name is None:
        yield
        return
    command = [sys.executable, str(EXAMPLES / "paper" / name), world]
    program = subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=sys.stderr)
    assert program.stdout is not None
    assert any("ready" in line for line in program.stdout)
    yield
    program.kill()
    program.wait(10)


#: Examples that are drawn in both versions of Qt; every one is loaded in both.
DRAWN_IN_BOTH = {
    "camera",
    "figure4",
    "figure5",
    "image_publisher",
    "message_tree",
    "operator_screen",
    "panel",
}


@pytest.fixture(
    params=[
        pytest.param(
            file,
            id=file.stem,
            marks=[pytest.mark.both_qt] if file.stem in DRAWN_IN_BOTH else [],
        )
        for file in FILES
    ]
)
def file(request: Any) -> Path:
    """An example."""
    made: Path = request.param
    return made


@pytest.mark.both_qt
@pytest.mark.usefixtures("messages")
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_loads(path: Path, running: Bench, caplog: pytest.LogCaptureFixture) -> None:
    from rosglass.controls import register
    from rosglass.qt import QtCore, QtQml

    register()
    component = QtQml.QQmlComponent(running.engine, QtCore.QUrl.fromLocalFile(str(path)))
    root = component.create()
    assert root is not None, component.errorString()
    said = [record.getMessage() for record in caplog.records]
    assert [text for text in said if any(word in text for word in MISTAKES)] == []
    root.deleteLater()


@pytest.mark.xvfb
@pytest.mark.usefixtures("partner")
def test_it_runs(file: Path, world: str, screen: str, start: Any, tmp_path: Path) -> None:
    from rosglass.qt import QtGui

    target = tmp_path / "picture.png"
    arguments = ["run", file, "--url", world, "--screenshot", target, "--after", "1"]
    program = start(*arguments, display=screen)
    code = program.end(60)
    logged = [line for line in program.lines if "WARNING" in line or "ERROR" in line]
    assert (code, logged) == (0, []), program.text
    picture = QtGui.QImage(str(target))
    assert (picture.width(), picture.height()) >= (300, 200)
    colours = {
        picture.pixel(x, y)
        for x in range(0, picture.width(), 3)
        for y in range(0, picture.height(), 3)
    }
    assert len(colours) > 10


#: Loads an example, clicks each button once that is enabled, and logs what the window shows.
OPERATOR = """
import QtQuick 2.15
Item {
    id: operator
    width: 900; height: 700
    property var clicked: []
    property string last: ""
    Loader { id: example; anchors.fill: parent; source: "SOURCE" }
    function visit(item, look) {
        if (!item.visible) return
        look(item)
        for (let i = 0; i < item.children.length; ++i) visit(item.children[i], look)
    }
    Timer {
        interval: 100; running: true; repeat: true
        onTriggered: {
            const shown = [], buttons = []
            let next = null
            operator.visit(example, item => {
                if (item.checkable !== undefined && item.clicked !== undefined) {
                    buttons.push(item.text)
                    // The last one first: what it does may enable those before it.
                    if (item.enabled && operator.clicked.indexOf(item) < 0) next = item
                }
                if (item.textFormat !== undefined && item.text)
                    shown.push([item.text, String(item.color), item.enabled, item.opacity,
                                Math.round(item.mapToItem(null, 0, 0).y)])
            })
            const text = JSON.stringify([buttons, shown])
            if (text !== operator.last) console.log("SHOWN " + text)
            operator.last = text
            if (next === null) return
            operator.clicked.push(next)
            console.log("CLICKED " + next.text)
            if (next.checkable) next.toggle()
            next.clicked()
        }
    }
}
"""
#: The buttons of the examples that the robot's side of this test enables.
BUTTONS = {
    "action_client": {"Face north", "Face east"},
    "figure5": {"Stand up", "Sit down", "wave", "nod", "bow", "point"},
    "logging": {"Info", "Warn", "Debug on"},
    "panel": {"Stop", "Flashlight"},
    "promises": {"Again"},
    "publisher": {"Flashlight"},
    "remote_control": {"Flashlight: Off"},
    "service_client": {"On", "Off"},
}
#: Parts of what an example shows once its robot was killed: a text, or a colour.
SIGNS = {
    "action_client": "is not available yet",
    "camera": "NO IMAGE",
    "figure4": "waiting for /pose_prediction/get_iteration",
    "figure5": "Motors  (OLD)",
    "image_publisher": "#ff0000",
    "panel": "#ff0000",
    "parameters": "waiting for /robot",
    "previews": "NO IMAGE",
    "publisher": "#ff0000",
    "qos": "#ff0000",
    "remote_control": "NO IMAGE",
    "service_client": "is not available yet",
    "subscription": "OLD: ",
    "synchronized_subscription": "NO PAIRS",
    "tf_broadcaster": "#ff0000",
    "tf_transforms": "#ff0000",
    "time": "#ff0000",
}
#: Phrases of Qt and JavaScript about mistakes in a file.
MISTAKES = ("is not defined", "TypeError", "ReferenceError", "Unable to assign", "Cannot read")


class Operated:
    """An example that is operated, and its robot."""

    def __init__(self, start: Callable[..., Any], file: Path, screen: str, folder: Path) -> None:
        from rosglass.wires.zenoh.router import Router

        self.router = Router(f"tcp/127.0.0.1:{free_port()}")
        partner = PARTNERS.get(file.stem)
        robot = [*ROBOT, "--url", self.router.url]
        if partner is not None:
            robot = [sys.executable, str(EXAMPLES / "paper" / partner), self.router.url]
        self.robot = subprocess.Popen(robot, stdout=subprocess.DEVNULL)
        wrapper = folder / "Operator.qml"
        wrapper.write_text(OPERATOR.replace("SOURCE", file.as_uri()))
        url = "" if file.stem == "replay" else self.router.url
        given = ("--url", url) if url else ()
        self.program = start("run", wrapper, *given, display=screen, HOME=str(folder))

    @property
    def shown(self) -> list[Any]:
        """The buttons, and each text with colour, whether it is enabled, opacity and place."""
        found = [line for line in self.program.lines if "SHOWN " in line]
        return json.loads(found[-1].partition("SHOWN ")[2]) if found else [[], []]

    @property
    def clicked(self) -> set[str]:
        """The texts of the buttons that were clicked."""
        parts = [line.partition("CLICKED ") for line in self.program.lines]
        return {text for _, found, text in parts if found}

    @property
    def mistakes(self) -> list[str]:
        """The log's lines about mistakes in the example."""
        return [line for line in self.program.lines if any(word in line for word in MISTAKES)]

    def close(self) -> None:
        """End the robot and the router; the fixture ends the program."""
        self.robot.kill()
        self.robot.wait(10)
        self.router.close()


OPERATED = sorted({*BUTTONS, *SIGNS})


@pytest.mark.xvfb
@pytest.mark.parametrize("name", OPERATED)
def test_every_button_works_and_a_lost_robot_is_seen(
    name: str, screen: str, start: Any, tmp_path: Path
) -> None:
    (file,) = [file for file in FILES if file.stem == name]
    operated = Operated(start, file, screen, tmp_path)
    try:
        buttons = BUTTONS.get(name, set())
        eventually(
            lambda: operated.clicked >= buttons, lambda: operated.program.text[-3000:], timeout=60
        )
        sign = SIGNS.get(name)
        if sign is not None:

            def is_seen() -> bool:
                return any(sign in str(part) for text in operated.shown[1] for part in text)

            # Values are shown as live before: other parts are red until the first ones arrive.
            eventually(
                lambda: operated.shown[1] and not is_seen(), lambda: operated.shown, timeout=60
            )
            operated.robot.kill()
            eventually(is_seen, lambda: operated.shown, timeout=30)
        assert operated.mistakes == []
    finally:
        operated.close()


@pytest.mark.xvfb
def test_iterations_of_figure_4_are_not_mixed_up(screen: str, start: Any, tmp_path: Path) -> None:
    """Values stand under the iteration that they belong to, or say so at once."""
    source = (EXAMPLES / "paper/figure4.qml").read_text()
    # The operator drags the slider when the test sends a signal, in place of a mouse.
    moved = source.replace(
        "onMoved: root.show(value)",
        "onMoved: root.show(value)\n"
        "Timer { interval: 50; running: root.step !== null; repeat: true\n"
        "onTriggered: if (slider.value < 15) { slider.value += 1; slider.moved() } }",
    )
    assert moved != source
    file = tmp_path / "figure4.qml"
    file.write_text(moved)
    operated = Operated(start, file, screen, tmp_path)
    try:
        # The robot hangs as soon as it has answered once.
        eventually(lambda: any("stability" in text[0] for text in operated.shown[1]), timeout=60)
        operated.robot.send_signal(signal.SIGSTOP)
        eventually(lambda: any(text[0] == "iteration 15" for text in operated.shown[1]))
        texts = [text[0] for text in operated.shown[1]]
        assert any(text.startswith("asking for iteration 15; above: iteration ") for text in texts)
    finally:
        operated.robot.send_signal(signal.SIGCONT)
        operated.close()


@pytest.mark.xvfb
def test_titles_of_figure_5_are_not_drawn_over(screen: str, start: Any, tmp_path: Path) -> None:
    operated = Operated(start, EXAMPLES / "paper/figure5.qml", screen, tmp_path)
    try:
        states = {"sitting", "standing"}
        eventually(lambda: states & {text[0] for text in operated.shown[1]}, timeout=60)
        places = {text[0].strip(): text[4] for text in operated.shown[1]}
        (state,) = states & places.keys()
        assert places["State"] + 15 < places[state]
    finally:
        operated.close()


def test_no_button_of_an_example_is_forgotten() -> None:
    """Those that a robot's request enables are clicked by the tests of servers."""
    asked = {"action_server", "servers", "service_server", "replay"}
    with_buttons = {
        file.stem for file in FILES if re.search(r"\b(Button|Switch|CheckBox) {", file.read_text())
    }
    assert with_buttons == {*BUTTONS, *asked}
