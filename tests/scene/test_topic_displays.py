"""Rules for all displays of a topic: bad names and frames, each message, another fixed frame."""

from __future__ import annotations

import itertools
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from inside import endpoint_of, queue_of, waiting_of

from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.mesh_shapes import CYLINDER, SPHERE

if TYPE_CHECKING:
    from conftest import SceneBench

STAMP = {"sec": 5, "nanosec": 0}
CLOUD = {"header": {"frame_id": "map"}, "height": 1, "is_dense": True}


def parts(display: Any, shape: Any) -> list[Any]:
    found = [(one, pose) for one, pose, _ in display.root.drawables()]
    return [
        (one, pose)
        for one, pose in found
        if (isinstance(one, Mesh) and one.shape is shape) or (shape is Lines and type(one) is Lines)
    ]


def test_a_header_without_a_frame_is_an_error(bench: SceneBench) -> None:
    view = bench.load('PathDisplay { topic: "/plan" } MapDisplay { topic: "/map" }')
    path, area = view.scene.displays
    plan = bench.robot.create_publisher("/plan", "nav_msgs/Path")
    grid = bench.robot.create_publisher("/map", "nav_msgs/OccupancyGrid")
    info = {"resolution": 1.0, "width": 1, "height": 1, "origin": {"orientation": {"w": 1.0}}}

    def send(**header: Any) -> bool:
        plan.publish({"header": header})
        grid.publish({"header": header, "info": info, "data": [0]})
        return path.received > 0 and area.received > 0

    bench.wait(send)
    for display in (path, area):
        assert display.statusLevel == "error"
        assert "header.frame_id is empty" in display.statusText
        assert display.status_lines["Topic"].text.endswith(" messages received")
    assert not len(path.root)
    bench.wait(lambda: send(frame_id="map") and path.statusLevel == area.statusLevel == "ok")


def test_a_volatile_display_says_that_earlier_messages_are_kept(bench: SceneBench) -> None:
    """The usual mistake with maps in configs of RViz 2."""
    from rosglass.comm import QoS

    plan = bench.robot.create_publisher("/plan", "nav_msgs/Path", QoS.latched())
    plan.publish({"header": {"frame_id": "map"}})
    display = bench.show('PathDisplay { topic: "/plan"; durability: "Volatile" }')
    bench.wait(lambda: "request transient local durability" in display.statusText)
    display.durability = "Transient Local"
    bench.wait(lambda: display.statusLevel == "ok")


def test_a_reference_frame_of_rviz_1_may_have_a_slash(bench: SceneBench) -> None:
    view = bench.load('AxesDisplay { frame: "/map" } AxesDisplay { frame: "/mast" }')
    bench.place("mast", at=(1, 0, 0))
    bench.wait(view.scene.frames)
    bench.wait(lambda: all(one.statusLevel == "ok" for one in view.scene.displays))


def test_invalid_topic_is_an_error_until_it_is_valid(bench: SceneBench) -> None:
    view = bench.load(
        'PathDisplay {} ImageDisplay {} InteractiveMarkersDisplay {} PathDisplay { topic: "~plan" }'
    )
    *empty, wrong = view.scene.displays
    for display in empty:
        bench.wait(lambda display=display: display.statusLevel == "warn")
        assert display.statusText == "Topic: no topic is chosen"
    bench.wait(lambda: wrong.statusLevel == "error")
    assert wrong.statusText.startswith("Topic: ")
    assert "~plan" in wrong.statusText
    wrong.topic = "/plan"
    bench.wait(lambda: wrong.statusText == "Topic: No messages received on /plan")
    assert wrong.problem == ""


def test_the_status_says_why_nothing_was_received(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from rosglass.qml.elements import element

    monkeypatch.setattr(element, "NO_PEER_MS", 50)
    scene = bench.load("ImagePanels { view: parent }").scene
    kinds = [name for name, kind in scene.TYPES.items() if kind.TOPIC_KEYS]
    assert len(kinds) > 20
    for name in kinds:
        scene.add(name, topic="/skan")
    for display in scene.displays:
        end = "/update" * (display.TYPE == "InteractiveMarkers")
        wanted = f"Topic: No messages received on /skan{end}: it has no publisher"
        bench.wait(lambda: wanted in display.statusText, lambda: (display, display.statusText))  # noqa: B023
    publisher = bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan")
    scan, path = scene.find("LaserScan"), scene.find("Path")
    bench.wait(lambda: scan.statusText.endswith("no publisher; did you mean /scan?"))
    path.topic = scan.topic = "/scan"
    bench.wait(lambda: path.statusLevel == "error")
    wrong = "Topic: the topic's type is sensor_msgs/msg/LaserScan, not nav_msgs/Path"
    assert path.statusText == wrong
    assert f"display 'Path': /scan: {wrong[7:]}" in caplog.text
    bench.wait(lambda: scan.statusText == "Topic: No messages received on /scan")
    # It may not be the subscription of the scan that the publisher knows already.
    message = {"header": {"frame_id": "map"}, "ranges": [1.0], "range_max": 2.0}
    bench.wait(lambda: publisher.publish(message) or " messages received" in scan.statusText)


def test_depth_images_that_have_no_publisher_are_named_where_a_calibration_came(
    bench: SceneBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rosglass.qml.elements import element

    monkeypatch.setattr(element, "NO_PEER_MS", 1500)
    display = bench.show('DepthCloudDisplay { topic: "/depth/image" }')
    info = bench.robot.create_publisher("/depth/camera_info", "sensor_msgs/CameraInfo")
    bench.wait(lambda: info.publish() or display.received)
    wanted = "No messages received on /depth/image: it has no publisher"
    bench.wait(lambda: wanted in display.statusText, lambda: display.statusText)


def test_a_policy_that_no_publisher_offers_is_named(bench: SceneBench) -> None:
    from rosglass.comm.qos import QoS, Reliability

    display = bench.show('LaserScanDisplay { topic: "/scan"; reliability: "Reliable" }')
    qos = QoS(reliability=Reliability.BEST_EFFORT)
    scans = bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan", qos)
    bench.wait(lambda: "best effort" in display.statusText, lambda: display.statusText)
    assert display.statusText.startswith("Topic: No messages received on /scan: ")
    assert display.statusLevel == "warn"
    display.reliability = "Best Available"
    bench.wait(lambda: scans.publish(SCAN) or display.statusLevel == "ok")


@pytest.mark.parametrize(
    ("kind", "message", "settings", "shape"),
    [
        ("PointStamped", "geometry_msgs/PointStamped", {"historyLength": 20}, SPHERE),
        ("Path", "nav_msgs/Path", {"bufferLength": 20}, Lines),
        ("Odometry", "nav_msgs/Odometry", {"covariance": False}, CYLINDER),
    ],
)
def test_each_message_of_a_history_is_shown_once_in_any_fixed_frame(
    bench: SceneBench, kind: str, message: str, settings: dict[str, Any], shape: Any
) -> None:
    view = bench.load()
    bench.place("odom", at=(1, 0, 0))
    bench.wait(view.scene.frames)
    display = view.scene.add(kind, topic="/shown", **settings)
    publisher = bench.robot.create_publisher("/shown", message)
    bench.wait(lambda: endpoint_of(display) is not None and publisher.subscription_count())
    for number in range(12):
        point = {"x": float(number), "y": 0.0, "z": 0.0}
        pose = {"position": point, "orientation": {"w": 1.0}}
        content: dict[str, Any] = {
            "PointStamped": {"point": point},
            "Path": {"poses": [{"pose": pose}, {"pose": pose}]},
            "Odometry": {"pose": {"pose": pose}},
        }[kind]
        publisher.publish({"header": {"frame_id": "odom"}, **content})
    bench.wait(lambda: display.received == 12)

    def count() -> int:
        return sum(one.count if shape is CYLINDER else 1 for one, _ in parts(display, shape))

    assert count() == 12
    view.fixedFrame = "odom"
    # Where the earlier ones are in it is not known.
    assert count() == 1
    ((last, pose),) = parts(display, shape)
    if shape is not Lines:
        pose = pose @ last.instances["matrix"][0].reshape(4, 4).T
        assert pose[0, 3] == pytest.approx(11.0 + 0.5 * (shape is CYLINDER))
    else:
        assert np.allclose(pose, np.eye(4))


@pytest.mark.parametrize("length", [1, 5])
def test_a_kept_message_is_shown_once_a_new_fixed_frame_exists(
    bench: SceneBench, length: int
) -> None:
    from rosglass.comm.qos import QoS

    view = bench.load()
    display = view.scene.add("PointStamped", topic="/point", historyLength=length)
    points = bench.robot.create_publisher("/point", "geometry_msgs/PointStamped", QoS.latched())
    points.publish({"header": {"frame_id": "map", "stamp": STAMP}})
    bench.wait(lambda: len(parts(display, SPHERE)) == 1)
    view.fixedFrame = "odom"
    assert parts(display, SPHERE) == []
    assert display.statusLevel == "error"
    bench.place("map", at=(3, 0, 0), parent="odom")
    bench.wait(lambda: len(parts(display, SPHERE)) == 1)
    ((_, pose),) = parts(display, SPHERE)
    assert pose[0, 3] == 3.0
    assert display.statusLevel == "ok", display.statusText


def test_messages_that_wait_for_their_transform_are_all_shown_later(
    bench: SceneBench, monkeypatch: Any
) -> None:
    from rosglass.scene.displays import topic_display as displays

    view = bench.load()
    odometry = view.scene.add("Odometry", topic="/odom", covariance=False)
    points = view.scene.add("PointStamped", topic="/point", historyLength=3)
    clouds = view.scene.add("PointCloud2", topic="/cloud", decayTime=60.0)
    publishers = [
        bench.robot.create_publisher("/odom", "nav_msgs/Odometry"),
        bench.robot.create_publisher("/point", "geometry_msgs/PointStamped"),
        bench.robot.create_publisher("/cloud", "sensor_msgs/PointCloud2"),
    ]
    bench.wait(lambda: all(one.subscription_count() for one in publishers))

    header = {"frame_id": "odom"}
    for number in range(12):
        pose = {"position": {"x": float(number)}, "orientation": {"w": 1.0}}
        publishers[0].publish({"header": header, "pose": {"pose": pose}})
        publishers[1].publish({"header": header})
        publishers[2].publish({**CLOUD, "header": header})
        bench.wait(lambda: min(one.received for one in view.scene.displays) == number + 1)  # noqa: B023
    bench.wait.settled(bench.session)
    for display in (odometry, points):
        assert "Dropped" not in display.statusText
    bench.place("odom", at=(1, 0, 0))
    bench.wait(lambda: sum(one.count for one, _ in parts(odometry, CYLINDER)) == 12)
    assert len(parts(points, SPHERE)) == 3
    # Of clouds, which are large, only the setting Depth are kept.
    assert "Dropped messages: 7 while more than 5, or 256 MiB, waited for" in clouds.statusText
    # What is more than that is said.
    monkeypatch.setattr(displays, "MOST_WAITING", 10)
    odometry.topic = "/odom2"
    other = bench.publisher("/odom2", "nav_msgs/Odometry")
    for number in range(12):
        other.publish({"header": {"frame_id": "nowhere"}})
        bench.wait(lambda: odometry.received == number + 1)  # noqa: B023
    bench.wait(lambda: "Dropped messages: 2" in odometry.statusText, lambda: odometry.statusText)
    # One that can be placed does not wait for them.
    monkeypatch.setattr(displays, "_MOST_MISSES", 3)
    other.publish({"header": header, "pose": {"pose": pose}})
    bench.wait(lambda: sum(one.count for one, _ in parts(odometry, CYLINDER)) == 1)
    odometry.topic = "/odom"
    assert "Dropped" not in odometry.statusText


def test_bytes_of_what_waits_are_bounded(bench: SceneBench, monkeypatch: Any) -> None:
    from rosglass.qml.elements import message_queue
    from rosglass.scene.displays import topic_display

    view = bench.load()
    display = view.scene.add("PointCloud2", topic="/cloud", decayTime=60.0, depth=100)
    publisher = bench.publisher("/cloud", "sensor_msgs/PointCloud2")
    cloud = {**CLOUD, "header": {"frame_id": "odom"}}
    publisher.publish(cloud)
    bench.wait(lambda: waiting_of(display))
    size = waiting_of(display)[0].size
    assert 30 < size < 200
    # Never the newest one.
    for limit, kept in ((3 * size, 3), (size - 1, 1)):
        for module in (message_queue, topic_display):
            monkeypatch.setattr(module, "MAX_WAITING_BYTES", limit)
        for _ in range(5):
            publisher.publish(cloud)
        bench.wait(lambda kept=kept: len(waiting_of(display)) == kept)
    bench.wait(lambda: display.received == 11)
    assert "while more than 100, or 0 MiB, waited for their transforms" in display.statusText
    # Nor do more of them wait for the GUI thread.
    (queue, sample) = queue_of(display), waiting_of(display)[-1]
    drained, _ = queue.drain()
    assert drained == []
    monkeypatch.setattr(queue, "_executor", type("", (), {"post": lambda *_: None})())
    for _ in range(5):
        publisher.publish(cloud)
    bench.wait(lambda: queue.received == 16)
    assert len(queue.drain()[0]) == 1
    assert sample.size == size


def test_shown_data_fades_while_newer_data_waits_for_its_transform(bench: SceneBench) -> None:

    view = bench.load('PointStampedDisplay { topic: "/point" } GridDisplay {}')
    display = view.scene.displays[0]
    points = bench.robot.create_publisher("/point", "geometry_msgs/PointStamped")

    def move(second: int) -> None:
        bench.move("arm", (0, 0, 0), second)

    def send(second: int) -> None:
        stamp = {"sec": second, "nanosec": 0}
        points.publish({"header": {"frame_id": "arm", "stamp": stamp}})

    bench.wait(points.subscription_count)
    move(10)
    bench.wait(lambda: "arm" in view.scene.frames())
    send(10)
    bench.wait(lambda: len(parts(display, SPHERE)) == 1)
    assert (display.root.alpha, display.statusLevel) == (1.0, "ok")
    # Nothing else is received after this one.
    send(11)
    bench.wait(lambda: display.root.alpha < 1.0 and display.statusLevel == "error")
    assert "Transform: no transform from [arm]: Lookup would require" in display.statusText
    assert "Data: the transform of the newest message is not known; the last message is of" in (
        display.statusText
    )
    move(11)
    bench.wait(lambda: display.root.alpha == 1.0)
    assert display.statusLevel == "ok", display.statusText


def test_shown_data_fades_while_newer_data_is_stamped_ahead(bench: SceneBench) -> None:
    display = bench.show('PointStampedDisplay { topic: "/point" }')
    points = bench.robot.create_publisher("/point", "geometry_msgs/PointStamped")

    def send(ahead_ns: int) -> None:
        now = bench.robot.now()
        bench.move("arm", (0, 0, 0), now)
        stamp = type(now)(now.nanoseconds + ahead_ns)
        points.publish({"header": {"frame_id": "arm", "stamp": stamp}})

    bench.wait(points.subscription_count)
    bench.wait(lambda: send(0) or len(parts(display, SPHERE)) == 1)
    # The clock of the sensor's computer jumps ahead; transforms do not.
    bench.wait(lambda: send(5_000_000_000) or display.root.alpha < 1.0)
    assert "the transform of the newest message is not known" in display.statusText
    bench.wait(lambda: send(0) or display.root.alpha == 1.0)


SCAN = {
    "header": {"frame_id": "map"},
    "angle_min": -1.0,
    "angle_max": 1.0,
    "angle_increment": 1.0,
    "range_max": 10.0,
    "ranges": [1.0, 2.0, 3.0],
    "intensities": [1.0, 2.0, 3.0],
}
RANGE = {
    "header": {"frame_id": "map"},
    "field_of_view": 0.5,
    "max_range": 5.0,
    "range": 2.0,
}


def test_obstacles_fade_when_a_sensor_sends_nothing_any_more(
    bench: SceneBench, monkeypatch: Any
) -> None:
    from rosglass.scene.displays import topic_display as displays

    monkeypatch.setattr(displays, "_CONTINUOUS_S", 0.5)
    view = bench.load(
        'LaserScanDisplay { topic: "/scan" } RangeDisplay { topic: "/range" }'
        'PointCloud2Display { topic: "/points" } PointCloud2Display { topic: "/cloud_map" }'
    )
    *sensors, cloud_map = view.scene.displays
    cloud = "sensor_msgs/PointCloud2"
    publishers = [
        (bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan"), SCAN),
        (bench.robot.create_publisher("/range", "sensor_msgs/Range"), RANGE),
        (bench.robot.create_publisher("/points", cloud), CLOUD),
    ]
    # A map that is published once is valid until there is another one.
    bench.latch("/cloud_map", cloud, CLOUD)

    def send() -> bool:
        for publisher, message in publishers:
            publisher.publish(message)
        return all(one.received for one in view.scene.displays)

    bench.wait(send)
    assert [one.root.alpha for one in view.scene.displays] == [1.0] * 4
    # The drivers hang: their publishers are still there.
    bench.wait(lambda: all(one.root.alpha < 1.0 for one in sensors))
    for display in sensors:
        assert "Data: no message for" in display.statusText
        assert display.statusLevel == "warn"
    assert (cloud_map.root.alpha, cloud_map.statusLevel) == (1.0, "ok")
    bench.wait(lambda: send() and all(one.root.alpha == 1.0 for one in sensors))
    # Maps that are sent as clouds every 8 or 10 s do not flicker.
    points = sensors[2]
    points._intervals.extend((10.0, 8.0))
    assert points._outdated_after_s() == 16.0
    bench.wait(lambda: points.statusLevel == "ok", lambda: points.statusText)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("Odometry", {"pose": {"pose": {"orientation": {"w": 1.0}}}}),
        ("WrenchStamped", {"wrench": {"force": {"x": 1.0}}}),
        ("TwistStamped", {"twist": {"linear": {"x": 1.0}}}),
        ("AccelStamped", {"accel": {"linear": {"x": 1.0}}}),
        ("Temperature", {"temperature": 20.0}),
        ("FluidPressure", {"fluid_pressure": 1e5}),
        ("Illuminance", {"illuminance": 100.0}),
        ("RelativeHumidity", {"relative_humidity": 0.5}),
    ],
)
def test_continuous_measurements_fade_without_a_message(
    bench: SceneBench, monkeypatch: Any, kind: str, message: dict[str, Any]
) -> None:
    from rosglass.scene.displays import topic_display as displays

    monkeypatch.setattr(displays, "_CONTINUOUS_S", 0.5)
    display = bench.load().scene.add(kind, topic="/shown")
    publisher = bench.robot.create_publisher("/shown", display.MESSAGES[0])

    def send() -> bool:
        publisher.publish({"header": {"frame_id": "map"}, **message})
        return bool(display.received) and display.root.alpha == 1.0

    bench.wait(send)
    # The driver hangs: its publisher is still there.
    bench.wait(lambda: display.root.alpha < 1.0)
    assert "Data: no message for" in display.statusText
    bench.wait(send)


def test_a_sensor_may_send_nothing_while_a_simulation_is_paused(
    bench: SceneBench, monkeypatch: Any
) -> None:
    from rosglass.scene.displays import scene_frames as scenes
    from rosglass.scene.displays import topic_display as displays

    monkeypatch.setattr(displays, "_CONTINUOUS_S", 1.0)
    monkeypatch.setattr(scenes, "_PAUSED_S", 0.3)
    view = bench.load('LaserScanDisplay { topic: "/scan" }')
    (display,) = view.scene.displays
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    scans = bench.robot.create_publisher("/scan", "sensor_msgs/LaserScan")
    view.scene.node.parameters.set({"use_sim_time": True})
    bench.wait(lambda: clock.subscription_count() and scans.subscription_count())

    def set_time(seconds: int) -> None:
        clock.publish({"clock": {"sec": seconds, "nanosec": 0}})
        bench.wait(lambda: view.scene.now() == seconds * 10**9)

    set_time(10)
    # The change of time makes it subscribe anew.
    bench.wait.settled(bench.session)
    bench.wait(lambda: scans.publish(SCAN) or display.statusLevel == "ok")
    bench.wait.nothing_happens(1.8)
    assert (display.root.alpha, display.statusLevel) == (1.0, "ok"), display.statusText
    seconds = itertools.count(11)
    bench.wait(lambda: set_time(next(seconds)) or display.root.alpha < 1.0)


def test_lifetimes_and_the_decay_time_are_of_the_robots_time(bench: SceneBench) -> None:
    view = bench.load(
        'MarkerDisplay { topic: "/marker" } PointCloud2Display { topic: "/cloud"; decayTime: 0.5 }'
    )
    markers, clouds = view.scene.displays
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    marker = {
        "header": {"frame_id": "map"},
        "type": 1,
        "pose": {"orientation": {"w": 1.0}},
        "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
        "lifetime": {"sec": 0, "nanosec": 500_000_000},
    }
    field = {"name": "x", "offset": 0, "datatype": 7, "count": 1}
    cloud = {
        **CLOUD,
        "fields": [{**field, "name": name, "offset": 4 * at} for at, name in enumerate("xyz")],
        "width": 1,
        "point_step": 12,
        "row_step": 12,
        "data": np.ones(12, np.uint8),
    }
    publishers = [
        (bench.robot.create_publisher("/marker", "visualization_msgs/Marker"), marker),
        (bench.robot.create_publisher("/cloud", "sensor_msgs/PointCloud2"), cloud),
    ]
    view.scene.node.parameters.set({"use_sim_time": True})
    bench.wait(clock.subscription_count)

    def set_time(seconds: float) -> None:
        clock.publish({"clock": {"sec": int(seconds), "nanosec": round(seconds % 1 * 1e9)}})
        bench.wait(lambda: view.scene.now() == round(seconds * 1e9))

    def count() -> list[int]:
        return [len(list(one.root.drawables())) for one in view.scene.displays]

    def send() -> bool:
        for publisher, message in publishers:
            publisher.publish(message)
        return bool(markers.received and clouds.received)

    set_time(10.0)
    # The change of time makes them subscribe anew.
    bench.wait.settled(bench.session)
    bench.wait(send)
    bench.wait.settled(bench.session)
    shown = count()
    assert shown[0] == 1
    assert shown[1] > 0
    # A simulation that is slow, or paused.
    bench.wait.nothing_happens(0.8)
    assert count() == shown
    set_time(10.6)
    bench.wait(lambda: count() == [0, 0])


def test_nothing_is_late_while_the_robots_time_stands_still(bench: SceneBench) -> None:
    from rosglass import Time

    view = bench.load('PointStampedDisplay { topic: "/point" }')
    (display,) = view.scene.displays
    clock = bench.robot.create_publisher("/clock", "rosgraph_msgs/msg/Clock")
    points = bench.robot.create_publisher("/point", "geometry_msgs/PointStamped")
    view.scene.node.parameters.set({"use_sim_time": True})
    bench.wait(lambda: clock.subscription_count() and points.subscription_count())

    def send(second: int) -> None:
        stamp = {"sec": second, "nanosec": 0}
        points.publish({"header": {"frame_id": "arm", "stamp": stamp}})

    def set_time(seconds: float) -> None:
        stamp = Time(round(seconds * 1e9))
        clock.publish({"clock": {"sec": int(seconds), "nanosec": round(seconds % 1 * 1e9)}})
        bench.wait(lambda: view.scene.now() == stamp.nanoseconds)

    set_time(10.0)
    bench.move("arm", (0, 0, 0), 10)
    bench.wait(lambda: "arm" in view.scene.frames())
    # The change of time has made it subscribe anew.
    bench.wait(lambda: send(10) or len(parts(display, SPHERE)) == 1)
    bench.wait.settled(bench.session)
    before = display.received
    set_time(11.5)
    send(11)
    bench.wait(lambda: display.received > before)
    # Longer than data may wait for its transform.
    bench.wait.nothing_happens(1.6)
    assert (display.root.alpha, display.statusLevel) == (1.0, "ok"), display.statusText
    set_time(12.5)
    bench.wait(lambda: display.root.alpha < 1.0 and display.statusLevel == "error")


def test_messages_wait_for_the_gui_thread_as_one_job() -> None:
    from rosglass.comm.handle import Executor
    from rosglass.qml.elements.message_queue import MessageQueue

    class Waiting(Executor):
        jobs = 0

        def post(self, job: Any) -> None:
            self.jobs += 1

    def refuse(message: Any) -> None:
        raise ValueError(message)

    gui = Waiting()
    broken = MessageQueue(refuse, (), gui, lambda: None, depth=5)
    empty = MessageQueue(lambda _: None, (), gui, lambda: None, depth=5)
    for count in (2, 4):
        for number in range(100):
            for queue in (broken, empty):
                queue.put(lambda number=number: number, "nav_msgs/Path")  # type: ignore[misc]
        assert gui.jobs == count
        assert broken.drain() == ([], "this message could not be shown: ValueError(99)")
        assert empty.drain() == ([], "")
    assert broken.received == empty.received == 200


def test_a_message_that_was_held_back_fades_as_it_arrives(bench: SceneBench) -> None:
    from rosglass import Time

    display = bench.show('LaserScanDisplay { topic: "/scan" }')
    scan = bench.robot.create_publisher("/scan", "sensor_msgs/msg/LaserScan")

    def send(age: float) -> None:
        stamp = Time(time.time_ns() - round(age * 1e9))
        scan.publish({**SCAN, "header": {"frame_id": "map", "stamp": stamp}})

    def is_live() -> bool:
        send(0.0)
        return bool(display.received and display.root.alpha == 1.0)

    bench.wait(is_live)
    bench.wait(is_live)

    def is_faded() -> bool:
        send(30.0)
        return bool(display.root.alpha < 1.0)

    bench.wait(is_faded)
    assert "the newest message was 30 s late" in display.statusText
    bench.wait(is_live)
