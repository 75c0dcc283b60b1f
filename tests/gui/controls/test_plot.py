"""The control Plot."""

from __future__ import annotations

import csv
import json
import math
import time
from typing import Any

import pytest

pytestmark = pytest.mark.both_qt

POINT = "geometry_msgs/msg/PointStamped"
NUMBER = "std_msgs/msg/Float64"


class Shown:
    """A plot in a window, and its parts."""

    def __init__(self, controls: Any, declaration: str) -> None:
        controls.show(declaration.replace("{", '{ objectName: "plot";', 1), 600, 400)
        self.controls = controls
        self.item = controls.find("plot")
        self.data = controls.window.findChild(_qt().QObject, "plotData")
        self.lines = controls.find("lines")

    def get(self, name: str) -> Any:
        return self.data.property(name)

    def readings(self) -> list[str]:
        return list(self.get("readings"))

    def color_at(self, at: float, height: float) -> list[int]:
        """Return the colours in a column of pixels around a share of the plot's size."""
        image = self.controls.grab()
        place = self.lines.mapToScene(_qt().QPointF(0, 0))
        x = round(place.x() + at * (self.lines.width() - 1))
        y = round(place.y() + (1 - height) * (self.lines.height() - 1))
        return [image.pixel(x + dx, y + dy) for dx in (-1, 0, 1) for dy in range(-3, 4)]


def _qt() -> Any:
    from rosglass.qt import QtCore

    return QtCore


@pytest.fixture
def plot(controls: Any) -> Any:
    return lambda declaration: Shown(controls, declaration)


#: Seconds of the first stamp.
START = 1_700_000_000


def stamped(seconds: float, x: float, y: float = 0.0) -> dict[str, Any]:
    whole, part = divmod(round(seconds * 1e6) * 1000, 1_000_000_000)
    stamp = {"sec": whole, "nanosec": part}
    return {"header": {"stamp": stamp}, "point": {"x": x, "y": y}}


@pytest.fixture
def points(controls: Any, plot: Any, wait: Any) -> Any:
    """Show a plot, and send it points on the topic /point: time in seconds, x, and perhaps y."""

    def show(declaration: str, samples: list[tuple[float, ...]]) -> tuple[Shown, Any]:
        publisher = controls.robot.create_publisher("/point", POINT)
        shown = plot(declaration)
        wait(publisher.subscription_count)
        for sample in samples:
            publisher.publish(**stamped(*sample))
        wait(lambda: shown.get("received") == len(samples))
        return shown, publisher

    return show


def rows(shown: Shown, wait: Any, tmp_path: Any) -> list[dict[str, str]]:
    """Return the rows of the CSV file with all samples."""
    file = tmp_path / "all.csv"
    results: list[str] = []
    shown.data.saved.connect(results.append)
    shown.data.saveFailed.connect(results.append)
    shown.data.saveCsv(str(file))
    wait(lambda: results)
    assert results == [str(file)]
    with file.open(newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def test_every_sample_is_kept_with_its_stamp(points: Any, wait: Any, tmp_path: Any) -> None:
    shown, publisher = points(
        'Plot { paths: ["/point:point.x", "/point:point.y"]; window: 10 }',
        [(START + number / 1000, number, -number) for number in range(3000)],
    )
    found = rows(shown, wait, tmp_path)
    assert len(found) == 6000
    assert found[2999] == {
        "run": "0", "time": "1700000002.999000000", "series": "/point:point.x", "value": "2999.0",
    }  # fmt: skip
    assert shown.get("lost") == 0
    # One subscription for both paths.
    assert publisher.subscription_count() == 1


def test_lines_are_drawn_at_their_values(points: Any, wait: Any) -> None:
    shown, _ = points(
        "Plot { window: 10; leftMin: 0; leftMax: 10; timeout: 0; paused: true\n"
        'PlotSeries { path: "/point:point.x"; color: "#ff0000" } }',
        [(START + number / 100, number / 100) for number in range(1001)],
    )
    shown.data.toOldest()
    red = 0xFFFF0000
    wait(lambda: red in shown.color_at(0.55, 0.55))
    assert red in shown.color_at(0.25, 0.25)
    assert red not in shown.color_at(0.25, 0.75)


def test_plot_follows_theme_and_size_in_the_same_frame(points: Any, wait: Any) -> None:
    shown, _ = points(
        "Plot { property string mode; onModeChanged: Theme.mode = mode\n"
        "property color panel: Theme.panel; window: 10; leftMin: 0; leftMax: 10; timeout: 0\n"
        'paused: true; PlotSeries { path: "/point:point.x"; color: "#ff0000" } }',
        [(START + number / 100, number / 100) for number in range(1001)],
    )
    shown.data.toOldest()
    red = 0xFFFF0000
    wait(lambda: red in shown.color_at(0.55, 0.55))
    dark = shown.item.property("panel").rgb()
    assert dark in shown.color_at(0.25, 0.75)
    try:
        # No event is processed before the image.
        shown.item.setProperty("mode", "bright")
        bright = shown.item.property("panel").rgb()
        assert bright != dark
        assert bright in shown.color_at(0.25, 0.75)
        shown.item.setWidth(shown.item.width() - 150)
        assert red in shown.color_at(0.55, 0.55)
    finally:
        shown.item.setProperty("mode", "dark")


def test_silence_and_nan_are_gaps(points: Any, wait: Any) -> None:
    times = [number / 100 for number in range(1001) if not 400 < number < 600]
    shown, _ = points(
        "Plot { window: 10; leftMin: 0; leftMax: 2; paused: true; timeout: 0\n"
        'PlotSeries { path: "/point:point.x"; color: "#ff0000" } }',
        [(START + at, math.nan if 8 < at < 9 else 1.0) for at in times],
    )
    shown.data.toOldest()
    red = 0xFFFF0000
    wait(lambda: red in shown.color_at(0.2, 0.5))
    assert red in shown.color_at(0.7, 0.5)
    assert red not in shown.color_at(0.5, 0.5)
    assert red not in shown.color_at(0.85, 0.5)


def test_elements_of_an_array_are_lines(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/joints", "sensor_msgs/msg/JointState")
    shown = plot('Plot { paths: ["/joints:position[*]"] }')
    wait(publisher.subscription_count)
    publisher.publish(position=[1.0, 2.0, 3.0])
    wait(lambda: shown.readings() == ["1", "2", "3"])
    publisher.publish(position=[4.0])
    wait(lambda: shown.readings() == ["4", "NaN", "NaN"])
    names = [line["name"] for line in shown.get("legend")]
    assert names == [f"/joints:position[{at}]" for at in range(3)]


def test_large_array_is_limited_and_says_so(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    shown = plot('Plot { paths: ["/scan:ranges[*]"] }')
    wait(publisher.subscription_count)
    publisher.publish(ranges=[1.0] * 10_000)
    wait(lambda: "10000 elements, and the first 64 are plotted" in shown.get("problem"))
    assert len(shown.get("legend")) == 64


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("/point:point.q", "has no field 'q'"),
        ("/point:header.frame_id", "is a string, not a number"),
        ("/point:point", "plot one of its fields: x, y, z"),
        ("/point", "write it like /odom:twist.twist.linear.x"),
        ("/point:point..x", "malformed"),
        ("/po int:point.x", "/po int"),
    ],
)
def test_path_that_cannot_be_plotted_is_named(
    controls: Any, plot: Any, wait: Any, path: str, problem: str
) -> None:
    publisher = controls.robot.create_publisher("/point", POINT)
    shown = plot(f"Plot {{ paths: {json.dumps([path, '/point:point.x'])} }}")
    wait(publisher.subscription_count)
    publisher.publish(**stamped(START, 5.0))
    wait(lambda: problem in shown.get("problem"))
    # The other series lives on.
    wait(lambda: "5" in shown.readings())


def test_robot_that_is_gone_is_named_with_the_topic(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"] }')
    wait(publisher.subscription_count)
    publisher.publish(data=1.0)
    wait(lambda: shown.readings() == ["1"])
    publisher.close()
    wait(lambda: shown.get("problem").startswith("/value: it has had no publisher since"))


def test_index_beyond_an_array_is_a_gap_with_a_reason(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/joints", "sensor_msgs/msg/JointState")
    shown = plot('Plot { paths: ["/joints:position[2]", "/joints:velocity[0]"] }')
    wait(publisher.subscription_count)
    publisher.publish(position=[1.0, 2.0], velocity=[7.0])
    wait(lambda: shown.readings() == ["NaN", "7"])
    wait(lambda: "index 2 is out of range" in shown.get("problem"))
    publisher.publish(position=[1.0, 2.0, 3.0], velocity=[8.0])
    wait(lambda: shown.readings() == ["3", "8"])
    wait(lambda: shown.get("problem") == "")


def test_type_that_changes_is_named(controls: Any, plot: Any, wait: Any) -> None:
    first = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"] }')
    wait(first.subscription_count)
    first.publish(data=1.5)
    wait(lambda: shown.readings() == ["1.5"])
    first.close()
    second = controls.robot.create_publisher("/value", "std_msgs/msg/String")
    wait(lambda: (second.publish(data="now a text"), shown.get("problem"))[1])
    assert "/value" in shown.get("problem")


@pytest.mark.parametrize(
    "values", [[1e308, -1e308], [math.inf, -math.inf, 1.0], [math.nan] * 3, [5e-324, 0.0], [0.0]]
)
def test_extreme_values_are_drawn(controls: Any, plot: Any, wait: Any, values: list[float]) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"]; window: 0.5 }')
    wait(publisher.subscription_count)
    for value in values * 20:
        publisher.publish(data=value)
    wait(lambda: shown.get("received") == 20 * len(values))
    for logarithmic in (True, False):
        shown.data.setProperty("leftLog", logarithmic)
        wait.signals(controls.window.frameSwapped)
        assert not controls.grab().isNull()
    assert shown.get("leftTicks")


def test_time_that_goes_back_begins_a_new_run(points: Any, wait: Any, tmp_path: Any) -> None:
    shown, _ = points(
        'Plot { paths: ["/point:point.x"]; window: 10 }',
        [(start + number / 100, number) for start in (1000.0, 5.0) for number in range(100)],
    )
    wait(lambda: 5 < shown.get("end") < 100)
    found = rows(shown, wait, tmp_path)
    assert [row["run"] for row in found] == ["0"] * 100 + ["1"] * 100


def test_stamps_of_several_clocks_are_replaced_and_named(
    controls: Any, plot: Any, wait: Any
) -> None:
    publisher = controls.robot.create_publisher("/point", POINT)
    shown = plot('Plot { paths: ["/point:point.x"]; window: 10 }')
    wait(publisher.subscription_count)

    def mix() -> bool:
        for number in range(20):
            publisher.publish(**stamped(1000.0 if number % 2 else 5.0, number))
        return "several clocks" in shown.get("problem")

    wait(mix)
    wait(lambda: (mix(), shown.get("end") > 1e9)[1])


def test_plot_without_data_is_stale(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"]; timeout: 300 }')
    assert shown.item.property("stale")
    wait(publisher.subscription_count)
    publisher.publish(data=1.0)
    wait(lambda: not shown.item.property("stale"))
    wait(lambda: shown.item.property("stale"))
    assert shown.item.property("status").startswith("OLD")


def test_scrolling_pauses_and_stays_within_the_samples(points: Any, wait: Any) -> None:
    shown, _ = points(
        'Plot { paths: ["/point:point.x"]; window: 2 }',
        [(START + number / 100, number) for number in range(1000)],
    )
    wait(lambda: shown.get("end") > 1_700_000_009)
    shown.data.scroll(-3.0)
    assert shown.get("paused")
    end = shown.get("end")
    wait.nothing_happens(0.2)
    assert shown.get("end") == end
    shown.data.scroll(-1e30)
    assert shown.get("end") >= START
    shown.data.zoomBy(2, 0.5)
    assert shown.get("window") == 1
    values = shown.data.valuesAt(1.0)["values"]
    assert len(values) == 1
    shown.data.setProperty("paused", False)
    wait(lambda: shown.get("end") > 1_700_000_009)


def test_keys_pause_zoom_and_move_the_cursor(controls: Any, plot: Any, wait: Any) -> None:
    from rosglass.qt import QtGui

    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"]; window: 8 }')
    wait(publisher.subscription_count)
    publisher.publish(data=1.0)
    wait(lambda: shown.readings() == ["1"])
    controls.find("area").forceActiveFocus()
    keys = _qt().Qt.Key
    for key, modifier, name, value in (
        (keys.Key_Space, "NoModifier", "paused", True),
        (keys.Key_Plus, "NoModifier", "window", pytest.approx(6.4)),
        (keys.Key_Minus, "NoModifier", "window", pytest.approx(8)),
        (keys.Key_Left, "ShiftModifier", "cursor", pytest.approx(0.99)),
        (keys.Key_Escape, "NoModifier", "cursor", -1),
        (keys.Key_End, "NoModifier", "paused", False),
    ):
        for kind in (QtGui.QKeyEvent.KeyPress, QtGui.QKeyEvent.KeyRelease):
            event = QtGui.QKeyEvent(kind, key, getattr(_qt().Qt, modifier))
            _qt().QCoreApplication.sendEvent(controls.window, event)
        assert shown.item.property(name) == value


def test_marks_are_shown_and_saved(controls: Any, plot: Any, wait: Any, tmp_path: Any) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"] }')
    wait(publisher.subscription_count)
    publisher.publish(data=1.0)
    wait(lambda: shown.readings() == ["1"])
    shown.data.mark("<b>bump</b>, 1")
    assert shown.get("markCount") == 1
    assert [row["value"] for row in rows(shown, wait, tmp_path) if row["series"] == "mark"] == [
        "<b>bump</b>, 1"
    ]


def test_file_that_cannot_be_written_is_named(
    controls: Any, plot: Any, wait: Any, tmp_path: Any
) -> None:
    shown = plot('Plot { paths: ["/value:data"] }')
    results: list[str] = []
    shown.data.saveFailed.connect(results.append)
    shown.data.saveCsv(str(tmp_path / "none" / "a.csv"))
    wait(lambda: results)
    assert "No such file" in results[0]


def test_one_field_is_plotted_against_another(points: Any, wait: Any) -> None:
    angles = [number / 200 * math.pi for number in range(400)]
    shown, _ = points(
        "Plot { window: 100\n"
        'PlotSeries { path: "/point:point.y"; xPath: "/point:point.x"; color: "#ff0000" } }',
        [(START + angle, 10 * math.cos(angle), 10 * math.sin(angle)) for angle in angles],
    )
    assert shown.get("isXY")
    wait(lambda: "-10" in [tick["text"] for tick in shown.get("bottomTicks")])
    # A circle: its centre and its corners are empty.
    red = 0xFFFF0000
    wait(lambda: red in shown.color_at(0.5, 1.0))
    assert red not in shown.color_at(0.5, 0.5)
    assert red not in shown.color_at(0.05, 0.95)


def test_added_paths_keep_the_samples_of_the_others(
    controls: Any, plot: Any, wait: Any, tmp_path: Any
) -> None:
    publisher = controls.robot.create_publisher("/point", POINT)
    shown = plot('Plot { paths: ["/point:point.x"] }')
    wait(publisher.subscription_count)
    publisher.publish(**stamped(START, 1.0, 2.0))
    wait(lambda: shown.get("received") == 1)
    shown.data.setProperty("paths", ["/point:point.x", "/point:point.y"])
    wait(lambda: len(shown.get("legend")) == 2)
    publisher.publish(**stamped(1_700_000_001, 3.0, 4.0))
    wait(lambda: shown.readings() == ["3", "4"])
    assert [row["value"] for row in rows(shown, wait, tmp_path)] == ["1.0", "3.0", "4.0"]
    shown.data.setProperty("paths", [])
    wait(lambda: publisher.subscription_count() == 0)


def test_declared_series_has_value_and_unit(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")
    shown = plot(
        'Plot { PlotSeries { objectName: "one"; path: "/scan:angle_min"; label: "<b>a</b>" } }'
    )
    wait(publisher.subscription_count)
    publisher.publish(angle_min=0.25)
    wait(lambda: shown.readings() == ["0.25"])
    (line,) = shown.get("legend")
    assert (line["name"], line["unit"]) == ("<b>a</b>", "rad")


def test_plot_over_a_middleware(live: Any, wait: Any) -> None:
    """Stamps of either ROS version, and times of reception that are apart as the messages are."""
    from rosglass.controls import register

    register()
    stamps = live.robot.create_publisher("/point", POINT)
    plain = live.robot.create_publisher("/value", NUMBER)
    window: Any = live.load(
        'Window { visible: true; Plot { window: 10; paths: ["/point:point.x", "/value:data"] } }',
        "import QtQuick 2.15\nimport QtQuick.Window 2.15\nimport RosControls 1.0",
    )
    data = window.findChild(_qt().QObject, "plotData")
    wait(lambda: stamps.subscription_count() and plain.subscription_count())
    ros1 = live.robot.url.startswith("ros1")
    begin = time.time()
    for number in range(200):
        whole, part = divmod(time.time_ns(), 1_000_000_000)
        stamp = {"secs": whole, "nsecs": part} if ros1 else {"sec": whole, "nanosec": part}
        stamps.publish(header={"stamp": stamp}, point={"x": number})
        plain.publish(data=number)
        wait.nothing_happens(0.005)
    end = time.time()
    wait(lambda: data.property("received") == 400)
    assert data.property("lost") == 0
    wait(lambda: list(data.property("readings")) == ["199", "199"])
    for line in data.property("legend"):
        assert line["problem"] == ""
    data.setProperty("paused", True)
    # Halfway between first and last message is the middle one, by either kind of time.
    window_s, right = data.property("window"), data.property("end")
    middle = 1 - (right - (begin + end) / 2) / window_s
    values = [float(text) for text in data.valuesAt(middle)["values"]]
    assert values == pytest.approx([100, 100], abs=40)


def test_dropped_field_is_plotted(controls: Any, wait: Any) -> None:
    controls.show(
        """Item { width: 600; height: 400
            Plot { objectName: "plot"; anchors.fill: parent }
            Item { objectName: "field"; property string path: "/point:point.x"
                width: 10; height: 10
                property bool held: false
                property bool dropped: false
                Drag.keys: ["rosglass/path"]
                Drag.active: held
                onDroppedChanged: Drag.drop() } }""",
        600,
        400,
    )
    field, data = controls.find("field"), controls.window.findChild(_qt().QObject, "plotData")
    field.setProperty("held", True)
    field.setX(300)
    field.setY(200)
    wait.nothing_happens(0.1)
    field.setProperty("dropped", True)
    wait(lambda: [line["path"] for line in data.property("legend")] == ["/point:point.x"])


def test_image_is_written(controls: Any, plot: Any, wait: Any, tmp_path: Any) -> None:
    shown = plot(
        """Plot { property string target; property var outcomes: []
            onTargetChanged: savePng(target)
            onSaved: function(file) { outcomes = outcomes.concat([file]) }
            onSaveFailed: function(reason) { outcomes = outcomes.concat([reason]) } }"""
    )
    outcomes = lambda: _plain(shown.item.property("outcomes"))  # noqa: E731 - looked at twice
    shown.item.setProperty("target", str(tmp_path / "plot.png"))
    wait(lambda: outcomes() == [str(tmp_path / "plot.png")])
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
    shown.item.setProperty("target", str(tmp_path / "none/plot.png"))
    wait(lambda: len(outcomes()) == 2)
    assert "none/plot.png could not be written" in outcomes()[1]


def _plain(value: Any) -> Any:
    return value.toVariant() if hasattr(value, "toVariant") else value


def test_plots_come_and_go_while_messages_arrive(controls: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    controls.show(
        'Loader { objectName: "loader"; sourceComponent: Plot { width: 300; height: 200\n'
        'paths: ["/value:data"] } }'
    )
    loader = controls.find("loader")
    for turn in range(6):
        loader.setProperty("active", True)
        wait(publisher.subscription_count)
        for number in range(50):
            publisher.publish(data=number)
        if turn % 2:
            wait.nothing_happens(0.05)
        loader.setProperty("active", False)
        wait(lambda: publisher.subscription_count() == 0)


def test_samples_of_another_robot_are_dropped(controls: Any, plot: Any, wait: Any) -> None:
    publisher = controls.robot.create_publisher("/value", NUMBER)
    shown = plot('Plot { paths: ["/value:data"] }')
    wait(publisher.subscription_count)
    publisher.publish(data=1.0)
    wait(lambda: shown.readings() == ["1"])
    controls.engine_session.url = "memory://other"
    wait(lambda: shown.readings() == [""])
    assert shown.item.property("stale")
