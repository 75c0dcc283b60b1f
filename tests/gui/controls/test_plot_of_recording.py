"""A plot of a whole recording, of which nothing has been played yet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest
from mcap import writer as mcap_writer
from rosbags import rosbag1
from rosbags.typesys import Stores, get_typestore

import rosglass
from rosglass.interfaces import full_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.both_qt

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
POINT = "geometry_msgs/msg/PointStamped"
PATH = "/point:point.x"


def write_mcap(path: Path, values: list[float], *, seconds: float = 100.0, ahead: int = 0) -> Path:
    """Record stamped points; their stamps are so many seconds ahead."""
    kind: Any = rosglass.load(POINT)
    with path.open("wb") as stream:
        writer = mcap_writer.Writer(stream, chunk_size=16_384)
        writer.start("ros2")
        schema = writer.register_schema(POINT, "ros2msg", full_text(kind.definition).encode())
        number = writer.register_channel("/point", "cdr", schema)
        for at, value in enumerate(values):
            time = START + round(at * seconds * SECOND / (len(values) - 1))
            stamp = {"sec": time // SECOND + ahead, "nanosec": time % SECOND}
            fields = {"header": {"stamp": stamp}, "point": {"x": value}}
            writer.add_message(number, time, kind.encode(fields), time)
        writer.finish()
    return path


def write_bag(path: Path, values: list[float]) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with rosbag1.Writer(path) as writer:
        number = writer.add_connection("/point", "geometry_msgs/msg/Point", typestore=store)
        for at, value in enumerate(values):
            made = store.types["geometry_msgs/msg/Point"](value, 0.0, 0.0)
            data = store.serialize_ros1(made, "geometry_msgs/msg/Point")
            writer.write(number, START + at * SECOND // 10, data)
    return path


class Shown:
    """A plot on a recording that is paused."""

    def __init__(self, bench: Any, controls: Any, wait: Any, recording: Path, more: str) -> None:
        from rosglass.qml import Session, install
        from rosglass.qt import QtCore, QtQml

        self.session = Session(f"replay:{recording}?paused=true")
        self.engine = QtQml.QQmlEngine()
        install(self.engine, self.session)
        self.bench = type(bench)(self.session, self.engine, bench.world, recording.parent / "qml")
        self.session.init("ui")
        self.window = type(controls)(self.bench, wait)
        self.window.show(f'Plot {{ objectName: "plot"; {more} }}', 600, 400)
        self.item = self.window.find("plot")
        self.data = self.window.window.findChild(QtCore.QObject, "plotData")
        wait(lambda: self.session.node is not None)

    def get(self, name: str) -> Any:
        return self.data.property(name)

    @property
    def samples(self) -> Any:
        lines = self.data._lines
        return lines[0].samples if lines else None

    def count(self) -> int:
        return len(self.samples) if self.samples is not None else 0

    def close(self) -> None:
        from rosglass.qt import send_deferred_deletes

        self.bench.close()
        self.bench.robot.close()
        send_deferred_deletes()
        self.engine.deleteLater()
        send_deferred_deletes()


@pytest.fixture
def plot_of(bench: Any, controls: Any, wait: Any) -> Iterator[Callable[..., Shown]]:
    made: list[Shown] = []

    def show(recording: Path, more: str = f'paths: ["{PATH}"]') -> Shown:
        made.append(Shown(bench, controls, wait, recording, more))
        return made[-1]

    yield show
    for one in made:
        one.close()


def test_the_whole_recording_is_shown_before_it_is_played(
    plot_of: Any, tmp_path: Path, wait: Any
) -> None:
    shown = plot_of(write_mcap(tmp_path / "a.mcap", [float(at) for at in range(1001)]))
    wait(lambda: shown.count() == 1001, shown.count)
    assert shown.get("window") == pytest.approx(100)
    wait(lambda: shown.get("end") == pytest.approx(START / 1e9 + 100))
    assert not shown.get("stale")
    wait(lambda: shown.get("reading") == 1)
    # The values of the legend are those at the time that is played.
    playback = shown.session.node.playback
    playback.seek(25)
    wait(lambda: list(shown.get("readings")) == ["250"], lambda: shown.get("readings"))
    wait(lambda: shown.get("moment") == pytest.approx(START / 1e9 + 25))
    # Enlarged, it follows that time.
    shown.item.zoomBy(10, 1)
    wait(lambda: shown.get("end") == pytest.approx(START / 1e9 + 30))
    playback.seek(99)
    wait(lambda: shown.get("end") == pytest.approx(START / 1e9 + 100))


def test_paths_added_later_are_read_and_those_missing_are_named(
    plot_of: Any, tmp_path: Path, wait: Any
) -> None:
    shown = plot_of(write_mcap(tmp_path / "a.mcap", [1.0, 2.0, 3.0]))
    wait(lambda: shown.count() == 3)
    shown.item.add("/point:point.y")
    shown.item.add("/nothing:data")
    shown.item.add("/point:point.w")
    wait(lambda: sum(len(line.samples or ()) for line in shown.data._lines) == 6)
    wait(lambda: "a.mcap has no such topic" in shown.get("problem"), lambda: shown.get("problem"))
    assert "no field 'w'" in shown.get("problem")
    assert [len(line.samples or ()) for line in shown.data._lines] == [3, 3, 0, 0]


def test_more_samples_than_fit_are_reduced_to_their_extremes(
    plot_of: Any, tmp_path: Path, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.controls.plots import recorded

    monkeypatch.setattr(recorded, "_MAX_SAMPLES", 1000)
    values = [math.sin(at / 50) for at in range(20_000)]
    values[12_345] = 7.0
    shown = plot_of(write_mcap(tmp_path / "a.mcap", values))
    wait(lambda: shown.get("reading") == 1 and shown.get("merged") > 0)
    first, last = shown.samples.span
    assert first < START + SECOND
    assert last > START + 99 * SECOND
    assert 900 < shown.count() < 1200
    _, kept = shown.samples.runs()[0]
    assert max(kept) == 7.0
    wait(lambda: "extremes of 20000" in shown.item.property("note"))


def test_stamps_of_another_clock_are_the_times_of_the_plot(
    plot_of: Any, tmp_path: Path, wait: Any
) -> None:
    shown = plot_of(write_mcap(tmp_path / "a.mcap", [1.0, 2.0, 3.0], ahead=-1_000_000_000))
    wait(lambda: shown.count() == 3)
    wait(lambda: shown.get("end") == pytest.approx(START / 1e9 + 100 - 1e9))
    wait(lambda: shown.get("moment") == pytest.approx(START / 1e9 - 1e9, abs=0.1))


def test_a_ros_1_bag_is_plotted(plot_of: Any, tmp_path: Path, wait: Any) -> None:
    shown = plot_of(write_bag(tmp_path / "a.bag", [1.0, 5.0, 3.0]), 'paths: ["/point:x"]')
    wait(lambda: shown.count() == 3)


def test_only_what_is_played_on_request(plot_of: Any, tmp_path: Path, wait: Any) -> None:
    path = write_mcap(tmp_path / "a.mcap", [float(at) for at in range(1001)])
    shown = plot_of(path, f'paths: ["{PATH}"]; whole: false; window: 20')
    shown.session.node.playback.play()
    wait(lambda: 3 < shown.count() < 900)
    assert shown.get("window") == 20
    assert math.isnan(shown.get("moment"))
    assert not shown.window.find("moment").isVisible()
    shown.item.setProperty("whole", True)
    wait(lambda: shown.count() == 1001)
    shown.item.setProperty("whole", False)
    wait(lambda: shown.get("window") == 20)


def test_damage_is_named_and_the_rest_is_plotted(plot_of: Any, tmp_path: Path, wait: Any) -> None:
    path = write_mcap(tmp_path / "a.mcap", [float(at) for at in range(5001)])
    shown = plot_of(path)
    wait(lambda: shown.count() == 5001)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    shown.item.add("/point:point.y")
    wait(lambda: sum(len(line.samples or ()) for line in shown.data._lines[1:]) > 100)
    assert shown.count() == 5001
