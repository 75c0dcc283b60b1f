"""The element of docs/own_element.md does what the page says, in under 80 lines."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import pytest

from rosglass.qt import QT6

pytestmark = pytest.mark.skipif(
    not QT6,
    reason="with PySide2, registering the element after many other types broke those for the rest"
    ' of the process ("Cannot assign object of type Subscription to property of type QObject*")',
)

PAGE = (Path(__file__).parents[2] / "docs" / "own_element.md").read_text(encoding="utf-8")
CODE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
QML = re.search(r"```qml\n(.*?)```", PAGE, re.DOTALL)[1]
BATTERY, TEXT = "sensor_msgs/msg/BatteryState", "std_msgs/msg/String"


@pytest.fixture(scope="module")
def element(app: Any) -> type:
    """The class of the page, registered as the page says."""
    from rosglass.qt import QtQml

    names: dict[str, Any] = {"__name__": "topic_history", "QtQml": QtQml}
    exec(compile(CODE[0], "own_element.md", "exec"), names)
    registration = next(line for line in CODE[1].splitlines() if "qmlRegisterType" in line)
    exec(registration, names)
    return names["TopicHistory"]


def test_it_is_short() -> None:
    assert len(CODE[0].splitlines()) < 80


def test_the_chart_of_the_page_shows_the_last_values(
    element: type, running: Any, wait: Any
) -> None:
    battery = running.robot.create_publisher("/battery", BATTERY)
    root = running.load(
        QML[QML.index("Row") :].replace("length: 60", "length: 3"),
        "import QtQuick 2.15\nimport Charts 1.0",
    )
    bars = root.childItems
    wait(battery.subscription_count)
    for percentage in (0.1, 0.25, 0.5, 1.0):
        battery.publish(percentage=percentage)
    wait(lambda: [bar.height() for bar in bars()][:3] == [25, 50, 100])
    assert all(bar.property("color").name() != "#ffffff" for bar in bars() if bar.height())
    history = next(child for child in root.children() if isinstance(child, element))
    assert history.property("values") == [0.25, 0.5, 1.0]
    history.setProperty("length", 2)
    assert history.property("values") == [0.5, 1.0]


def test_the_program_of_the_page_shows_the_chart(python: Any, tmp_path: Path) -> None:
    announced = QML.replace('Ros2.init("chart")', '{ Ros2.init("chart"); console.warn("shown") }')
    (tmp_path / "chart.qml").write_text(announced, encoding="utf-8")
    chart = f'"{tmp_path / "chart.qml"}", url="local://chart"'
    program = python(CODE[0] + CODE[1].replace('"chart.qml"', chart))
    program.until("shown", 40)
    program.kill(signal.SIGINT)
    assert program.end(40) == 0, program.text
    assert [line for line in program.lines if "WARNING" in line or "Error" in line] == []


def test_it_refuses_reports_and_ends_like_every_element(
    element: type, running: Any, wait: Any, caplog: Any
) -> None:
    chat = running.robot.create_publisher("/chat", TEXT)
    root = running.load(
        "QtObject { property var history: TopicHistory { topic: '/chat' } }", "import Charts 1.0"
    )
    history = root.property("history")
    wait(chat.subscription_count)
    chat.publish(data="x")
    wait(lambda: "/chat: data is not a number" in history.property("problem"))
    chat.publish(data="2.5")
    wait(lambda: history.property("values") == [2.5])
    assert history.property("problem") == ""
    history.setProperty("length", 0)
    assert history.property("length") == 100
    assert "TopicHistory: length 0 is less than 1" in caplog.text
    history.setProperty("topic", "/other chat")
    wait(lambda: "/other chat" in history.property("problem"))
    history.setProperty("topic", "")
    wait(lambda: not running.world.subscriptions)
