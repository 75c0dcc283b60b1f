"""TwistCommand: what it sends, for whom, and what halts it."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import pytest
from waiting import nothing_happens

from rosglass.comm.graph import ConnectionState
from rosglass.controls.steering import command_sender
from rosglass.controls.steering.heartbeat import Heartbeat

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.comm import Node

pytestmark = pytest.mark.both_qt
SCREEN = """Item {
    anchors.fill: parent
    property QtObject driver: command
    property Item page: page_
    property Item a: a_
    property bool holdA: false
    property bool holdB: false
    property real forward: 1
    property bool modal: false
    property var reasons: []
    Window { id: other; width: 100; height: 100 }
    function openOther() { other.show(); other.requestActivate() }
    function dropA() { a_.destroy() }
    function steerOnce() { return command.steer(a_, 1, 0) }
    function steerBadly() { command.steer(a_, NaN, 0) }
    function steerWrongly() { return [command.steer(a_, 1, 0), nothing.here] }
    TwistCommand {
        id: command
        topic: "/cmd_vel"; acceleration: 0; deceleration: 0; turnAcceleration: 0
        onHalted: function (reason) { made.reasons = made.reasons.concat([reason]) }
    }
    Item {
        id: page_
        width: parent.width; height: parent.height
        Item { id: a_; objectName: "a"; width: 20; height: 20 }
        Item { id: b_; objectName: "b"; width: 20; height: 20 }
    }
    T.Popup { id: popup; modal: made.modal; visible: made.modal; width: 50; height: 50 }
    Timer {
        running: made.holdA; interval: 30; repeat: true; triggeredOnStart: true
        onTriggered: command.steer(a_, made.forward, 0.5)
    }
    Timer {
        running: made.holdB; interval: 30; repeat: true; triggeredOnStart: true
        onTriggered: command.steer(b_, -1, 0)
    }
    onHoldAChanged: if (!holdA && a_) command.release(a_)
    onHoldBChanged: if (!holdB) command.release(b_)
}"""


class Robot:
    """Keeps the forward speeds that it receives."""

    def __init__(self, node: Node, topic: str = "/cmd_vel", kind: str = "geometry_msgs/msg/Twist"):
        self.speeds: list[float] = []
        self.messages: list[Any] = []
        self._subscription = node.create_subscription(topic, kind, self._on_message)

    def _on_message(self, message: Any) -> None:
        self.messages.append(message)
        name = message.type.name
        plain = message
        if name.endswith("Stamped"):
            plain = message.twist if "Twist" in name else message.drive
        self.speeds.append(plain.linear.x if "Twist" in name else plain.speed)

    @property
    def moves(self) -> bool:
        return bool(self.speeds) and self.speeds[-1] != 0

    @property
    def zeros(self) -> int:
        """The number of zeros since the last other value."""
        count = 0
        for speed in reversed(self.speeds):
            if speed:
                break
            count += 1
        return count


class Drive:
    """A screen with two inputs, and the robot that it steers."""

    def __init__(self, controls: Any, wait: Any) -> None:
        self.wait, self.controls = wait, controls
        self.robot = Robot(controls.robot)
        self.screen = controls.show(SCREEN, imports="import QtQuick.Templates 2.15 as T")
        self.command = self.screen.property("driver")
        window = controls.window
        window.requestActivate()
        wait(window.isActive)
        wait(lambda: self.command._endpoint and self.command._endpoint._subscribers())

    def set(self, name: str, value: Any) -> None:
        self.screen.setProperty(name, value)

    def go(self) -> None:
        """Hold the first input until the robot moves; on a busy machine, more than once."""

        def moves() -> bool:
            if not self.command.active:
                self.set("holdA", False)
                self.set("reasons", [])
                self.set("holdA", True)
            return self.robot.moves and self.command.active

        self.wait(moves)

    def silent(self) -> bool:
        return self.command._endpoint is None or self.command._endpoint._due() is None

    def stops(self, reason: str = "") -> None:
        """The robot gets three zeros, and then nothing."""

        def is_silent() -> bool:
            count = len(self.robot.speeds)
            self.wait.nothing_happens(0.15)
            return self.silent() and len(self.robot.speeds) == count

        self.wait(lambda: self.robot.zeros >= 3 and is_silent())
        assert not self.command.active
        if reason:
            assert [one for one in self.reasons() if reason in one]

    def reasons(self) -> list[str]:
        """Why it was halted since it was held."""
        found = self.screen.property("reasons")
        return list(found if isinstance(found, list) else found.toVariant())


@pytest.fixture(autouse=True)
def short_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    """Repeat zeros for 0.1 s only."""
    monkeypatch.setattr(command_sender, "_ZERO_PHASE_S", 0.1)


@pytest.fixture
def drive(controls: Any, wait: Any) -> Drive:
    return Drive(controls, wait)


def test_sends_only_while_it_is_held(drive: Drive) -> None:
    drive.wait.nothing_happens(0.1)
    assert drive.robot.speeds == []
    drive.go()
    assert drive.command.holder == "a"
    assert set(drive.robot.speeds) == {0.5}
    assert drive.robot.messages[-1].angular.z == 0.5
    drive.wait(lambda: drive.command.speed == 0.5 and drive.command.turn == 0.5)
    drive.set("holdA", False)
    drive.stops()
    assert drive.reasons() == []
    assert drive.command.speed == 0
    drive.go()


def test_a_silent_input_halts_and_stays_off_until_it_is_let_go(drive: Drive) -> None:
    drive.go()
    nothing_happens(0.4)  # a frozen screen: Qt's event loop does not run
    assert drive.robot.zeros >= 3
    drive.stops("no command for 150 ms")
    assert drive.screen.property("holdA")
    assert "no command for 150 ms: let go first" in drive.command.problem
    drive.set("holdA", False)
    assert drive.command.problem == ""
    drive.go()


def test_a_frozen_screen_moves_nothing_afterwards(drive: Drive) -> None:
    """Commands that waited in its queues are not sent after it."""
    drive.go()
    nothing_happens(0.4)
    count = len(drive.robot.speeds)
    assert not drive.screen.steerOnce()
    drive.stops("no command for 150 ms")
    assert not any(drive.robot.speeds[count:])


def hide_page(drive: Drive) -> None:
    drive.screen.property("page").setProperty("visible", False)


def move_away(drive: Drive) -> None:
    drive.screen.property("a").setProperty("x", 5000)


def disable(drive: Drive) -> None:
    drive.screen.property("page").setProperty("enabled", False)


def hide_window(drive: Drive) -> None:
    drive.controls.window.setProperty("visible", False)


def fade_out(drive: Drive) -> None:
    drive.screen.property("page").setProperty("opacity", 0)


def shrink(drive: Drive) -> None:
    drive.screen.property("page").setProperty("scale", 0)


def scroll_away(drive: Drive) -> None:
    """As a SwipeView does that is narrower than its window."""
    drive.screen.property("a").setProperty("y", 120)
    drive.screen.property("page").setProperty("height", 100)
    drive.screen.property("page").setProperty("clip", True)


def scroll_away_without_a_size(drive: Drive) -> None:
    """An item without a size is where the item around it is."""
    drive.screen.property("page").setProperty("x", 10_000)
    drive.screen.property("a").setProperty("width", 0)


def open_window(drive: Drive) -> None:
    drive.screen.openOther()


def open_dialog(drive: Drive) -> None:
    drive.set("modal", True)


def drop_input(drive: Drive) -> None:
    drive.screen.dropA()


def block(drive: Drive) -> None:
    drive.command.setProperty("obstacle", "emergency stop")


def call_halt(drive: Drive) -> None:
    drive.command.halt()


def steer_badly(drive: Drive) -> None:
    drive.screen.steerBadly()


def lose_connection(drive: Drive) -> None:
    drive.controls.bench.session.node.set_status(ConnectionState.LOST, "the cable is out")


def change_clock(drive: Drive) -> None:
    drive.command._endpoint._wall_offset -= 60


@pytest.mark.parametrize(
    ("event", "reason"),
    [
        (hide_page, "the control is not visible"),
        (move_away, "the control is not visible"),
        (fade_out, "the control is not visible"),
        (shrink, "the control is not visible"),
        (scroll_away, "the control is not visible"),
        (scroll_away_without_a_size, "the control is not visible"),
        (disable, "the control is disabled"),
        (hide_window, "the window is not"),
        (open_window, "the window is not in front"),
        (open_dialog, "a dialog is open"),
        (drop_input, "the control is not visible"),
        (block, "emergency stop"),
        (call_halt, "halted by the program"),
        (steer_badly, "not a number"),
        (change_clock, "the system's clock was changed by +60.0 s"),
    ],
)
def test_halts(drive: Drive, event: Callable[[Drive], None], reason: str) -> None:
    drive.go()
    event(drive)
    drive.stops(reason)


def test_after_an_obstacle_everything_is_let_go_first(drive: Drive) -> None:
    drive.go()
    block(drive)
    drive.stops("emergency stop")
    drive.command.setProperty("obstacle", "")
    drive.set("holdB", True)
    drive.wait.nothing_happens(0.2)
    assert not drive.robot.moves
    drive.set("holdA", False)
    drive.wait.nothing_happens(0.2)
    assert not drive.robot.moves
    drive.set("holdB", False)
    drive.set("holdB", True)
    drive.wait(lambda: drive.robot.speeds[-1] == -0.5)


def test_the_first_input_steers_until_it_lets_go(drive: Drive) -> None:
    drive.go()
    drive.set("holdB", True)
    drive.wait.nothing_happens(0.2)
    assert drive.robot.speeds[-1] == 0.5
    assert "a is held: let go first" in drive.command.problem
    drive.set("holdA", False)
    drive.stops()
    drive.set("holdB", False)
    drive.set("holdB", True)
    drive.wait(lambda: drive.robot.speeds[-1] == -0.5)
    assert drive.command.holder == "b"


def test_an_input_that_falls_silent_counts_as_let_go(drive: Drive) -> None:
    """As code does that forgets to call release()."""
    assert drive.screen.steerOnce()
    drive.stops("no command for 150 ms")
    drive.wait(lambda: drive.command.problem == "")
    assert drive.screen.steerOnce()


def test_the_zeros_go_to_the_topic_that_is_left(drive: Drive) -> None:
    other = Robot(drive.controls.robot, "/b/cmd_vel")
    drive.go()
    drive.command.setProperty("topic", "cmd_vel")
    drive.command.setProperty("ns", "/b")
    drive.wait(lambda: drive.robot.zeros >= 3)
    drive.wait(lambda: drive.command._endpoint and drive.command._endpoint._subscribers())
    drive.wait.nothing_happens(0.2)
    assert other.speeds == []
    assert "the topic has changed: let go first" in drive.command.problem
    drive.set("holdA", False)
    drive.set("holdA", True)
    drive.wait(lambda: other.moves)
    assert not drive.robot.moves


def test_a_lost_connection_halts_and_gets_its_zeros_later(drive: Drive) -> None:
    drive.go()
    lose_connection(drive)
    drive.wait(lambda: drive.robot.zeros >= 8)
    assert not drive.silent()
    drive.controls.bench.session.node.set_status(ConnectionState.CONNECTED, "")
    drive.stops("the robot is not connected: the cable is out")


def test_robot_that_falls_silent_halts(drive: Drive) -> None:
    """Its commands may still be received, and the connection may not have noticed an outage yet."""
    odometry = drive.controls.robot.create_publisher("/odom", "nav_msgs/msg/Odometry")
    other = drive.controls.robot.create_publisher("/bert/odom", "nav_msgs/msg/Odometry")
    drive.command.heartbeatTimeout = 2000
    drive.wait(odometry.subscription_count)
    drive.go()  # although nothing has been received yet
    drive.set("holdA", False)

    def receives() -> bool:
        odometry.publish()
        other.publish()
        return drive.command._robot.age >= 0 and not drive.command._robot.stale

    def halts() -> bool:
        """A busy machine may halt it for another reason before."""
        drive.wait(receives)
        drive.go()
        drive.wait(lambda: not drive.command.active)
        return any("the robot sends no data: /odom is 2." in one for one in drive.reasons())

    drive.wait(halts)
    drive.wait(lambda: drive.robot.zeros >= 10, "zeros for as long as it is silent")
    assert not other.subscription_count()
    drive.set("holdA", False)
    drive.set("holdA", True)
    drive.wait(lambda: "the robot sends no data" in drive.command.problem)
    drive.wait(receives)
    drive.wait.settled(drive.controls.engine_session)
    assert not drive.command.active, "it has to be let go first"
    drive.set("holdA", False)
    drive.command.heartbeat = "/pulse"
    drive.go()  # as it was never received
    drive.set("holdA", False)
    drive.command.heartbeat = ""
    drive.wait(receives)
    drive.wait(lambda: drive.command._robot.stale)
    drive.command.heartbeatTimeout = 0
    drive.go()


@pytest.mark.parametrize(
    ("commands", "found", "chosen"),
    [
        ("/cmd_vel", ["/anna/odom", "/odom"], "/odom"),
        ("/cmd_vel", ["/camera/odom/sample", "/odometry/filtered"], "/odometry/filtered"),
        ("/anna/cmd_vel", ["/anna/base/odom", "/odom", "/bert/odom"], "/anna/base/odom"),
        ("/anna/base/cmd_vel", ["/anna/odom", "/odom", "/anna/arm/odom"], "/anna/odom"),
        ("/base/cmd_vel", ["/odom", "/bert/odom"], "/odom"),
        ("/anna/cmd_vel", ["/bert/odom"], ""),
        ("/anna/cmd_vel", ["/annabel/odom"], ""),
    ],
)
def test_nearest_odometry_shows_whether_the_robot_sends(
    app: Any, commands: str, found: list[str], chosen: str
) -> None:
    class Graph:
        def topics(self) -> dict[str, set[str]]:
            return {commands: {"geometry_msgs/msg/Twist"}} | {
                name: {"nav_msgs/msg/Odometry"} for name in found
            }

    heartbeat = Heartbeat()
    heartbeat._commands = commands
    assert heartbeat._select(Graph()) == chosen  # type: ignore[arg-type]


def test_robot_that_leaves_halts_although_others_listen(drive: Drive) -> None:
    recorder = drive.controls.robot.create_subscription(
        "/cmd_vel", "geometry_msgs/msg/Twist", print
    )
    drive.go()
    recorder.close()
    drive.wait(lambda: drive.robot.zeros >= 3)
    assert drive.reasons() == ["/cmd_vel has lost a subscriber"]
    drive.wait(lambda: "let go first" in drive.command.property("refusal"))


TWO = """Item {
    anchors.fill: parent
    property bool holdA: false
    property bool holdB: false
    property bool steersB: false
    property string refusalB: second.refusal
    component Command: TwistCommand {
        topic: "/cmd_vel"; acceleration: 0; deceleration: 0; turnAcceleration: 0
    }
    Command { id: first }
    Command { id: second }
    Item { id: a; objectName: "a"; width: 20; height: 20 }
    Item { id: b; objectName: "b"; width: 20; height: 20 }
    Timer {
        running: made.holdA; interval: 30; repeat: true; triggeredOnStart: true
        onTriggered: first.steer(a, 1, 0)
    }
    Timer {
        running: made.holdB; interval: 30; repeat: true; triggeredOnStart: true
        onTriggered: made.steersB = second.steer(b, -1, 0)
    }
    onHoldAChanged: if (!holdA) first.release(a)
    onHoldBChanged: if (!holdB) second.release(b)
}"""


def test_two_commands_of_a_topic_steer_one_at_a_time(controls: Any, wait: Any) -> None:
    robot, screen = Robot(controls.robot), controls.show(TWO)
    controls.window.requestActivate()
    wait(controls.window.isActive)

    def hold(name: str, speed: float) -> None:
        """Hold an input until the robot moves; on a busy machine, more than once."""

        def moves() -> bool:
            screen.setProperty(name, False)
            screen.setProperty(name, True)
            wait.nothing_happens(0.1)
            return bool(robot.speeds) and robot.speeds[-1] == speed

        wait(moves)

    hold("holdA", 0.5)
    screen.setProperty("holdB", True)
    wait(lambda: "a is held" in screen.property("refusalB"))
    assert -0.5 not in robot.speeds
    screen.setProperty("holdA", False)
    wait(lambda: robot.zeros >= 3)
    assert not screen.property("steersB"), "it was pressed while the other one was held"
    screen.setProperty("holdB", False)
    hold("holdB", -0.5)
    # Pressed more than once, its own zeros come in between.
    wait(lambda: robot.speeds[-3:] == [-0.5] * 3)
    # Within the second in which the first one's zeros would go on.
    begin = len(robot.speeds)
    wait(lambda: len(robot.speeds) > begin + 10)
    # A busy machine may halt it, after which it stays off.
    assert (0.0, -0.5) not in itertools.pairwise(robot.speeds[begin:])


def test_destruction_sends_the_zeros(controls: Any, wait: Any) -> None:
    robot = Robot(controls.robot)
    holder = controls.show("""Item {
        property Item loader: loader_
        Loader {
            id: loader_
            sourceComponent: TwistCommand {
                id: command
                topic: "/cmd_vel"
                property Timer timer: Timer {
                    interval: 30; repeat: true; running: true
                    onTriggered: command.steer(loader_, 1, 0)
                }
            }
        }
    }""")
    controls.window.requestActivate()
    wait(lambda: robot.moves)
    holder.property("loader").setProperty("active", False)
    wait(lambda: robot.zeros >= 3)
    wait(lambda: not controls.robot.publishers("/cmd_vel"))
    assert robot.zeros >= 3


def test_an_error_in_the_file_that_steers_halts(drive: Drive) -> None:
    drive.go()
    drive.screen.steerWrongly()
    drive.stops("nothing is not defined")


@pytest.mark.parametrize(
    ("kind", "field"),
    [
        ("geometry_msgs/msg/TwistStamped", "twist"),
        ("ackermann_msgs/msg/AckermannDrive", ""),
        ("ackermann_msgs/msg/AckermannDriveStamped", "drive"),
    ],
)
def test_the_type_is_that_of_the_subscriber(
    controls: Any, wait: Any, kind: str, field: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "Robot", lambda node: _robot(node, kind))
    drive = Drive(controls, wait)
    drive.go()
    message = drive.robot.messages[-1]
    if field:
        assert message.header.frame_id == "base_link"
        assert message.header.stamp.sec > 0
        message = message[field]
    if "Twist" in kind:
        assert (message.linear.x, message.angular.z) == (0.5, 0.5)
    else:
        assert message.speed == 0.5
        assert message.steering_angle == pytest.approx(0.25)
    drive.set("holdA", False)
    drive.stops()


def _robot(node: Node, kind: str, make: type[Robot] = Robot) -> Robot:
    return make(node, "/cmd_vel", kind)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("maxSpeed", -1.0, "maxSpeed -1 is not from 0 to 1000 m/s"),
        ("maxTurn", math.nan, "maxTurn nan"),
        ("type", "std_msgs/String", "type 'std_msgs/String' is not one of geometry_msgs/msg/Twist"),
        ("type", "Twist", "type 'Twist' is not a type name"),
    ],
)
def test_wrong_values_are_refused(
    drive: Drive, caplog: pytest.LogCaptureFixture, name: str, value: Any, text: str
) -> None:
    before = drive.command.property(name)
    drive.command.setProperty(name, value)
    assert drive.command.property(name) == before
    assert f"TwistCommand: {text}" in caplog.text


def test_a_ramp_limits_the_speed_but_not_the_halt(drive: Drive) -> None:
    drive.command.setProperty("acceleration", 1.0)
    drive.command.setProperty("deceleration", 2.0)
    drive.go()
    drive.wait(lambda: drive.robot.speeds[-1] == 0.5)
    up = list(drive.robot.speeds)
    assert up == sorted(up)
    assert len(up) > 8
    assert all(b - a <= 0.051 for a, b in itertools.pairwise(up))
    drive.set("forward", -1)
    drive.wait(lambda: drive.robot.speeds[-1] == -0.5)
    down = drive.robot.speeds[len(up) :]
    assert all(a - b <= 0.101 for a, b in itertools.pairwise(down))
    drive.set("holdA", False)
    drive.stops()
    last = max(at for at, speed in enumerate(drive.robot.speeds) if speed)
    assert drive.robot.speeds[last] == -0.5


@pytest.mark.parametrize(
    ("value", "target", "up", "down", "result"),
    [
        (0.0, 1.0, 0.1, 0.2, 0.1),
        (1.0, 0.0, 0.1, 0.2, 0.8),
        (0.1, -1.0, 0.1, 0.2, 0.0),
        (0.5, -1.0, 0.1, 0.2, 0.3),
        (0.5, -1.0, 0.1, 0.0, -0.1),
        (-1.0, 1.0, 0.0, 0.0, 1.0),
        (0.95, 1.0, 0.1, 0.2, 1.0),
    ],
)
def test_ramp(value: float, target: float, up: float, down: float, result: float) -> None:
    assert command_sender._approach(value, target, up, down) == pytest.approx(result)
