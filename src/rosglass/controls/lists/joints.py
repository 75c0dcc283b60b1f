"""The element ``JointTopic``: the joints of a robot, with their limits."""
# ruff: noqa: N815 - the names of slots and signals are QML's

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rosglass.comm.qos import QoS
from rosglass.controls.lists.joint_limits import JointLimits, read_joint_limits
from rosglass.controls.lists.merged_topic import MergedTopic
from rosglass.controls.lists.texts import bounded
from rosglass.errors import Error
from rosglass.qml.engine.properties import ReadOnly, Writable, one_of, report, within
from rosglass.qt import is_alive

if TYPE_CHECKING:
    from rosglass.messages import Message
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore

__all__ = ["JointTopic"]

#: Joints that are kept; further ones are counted.
_MAX_JOINTS = 1000
#: Seconds between two changes of the order by nearness, so that rows can be read.
_SORT_S = 1.0
#: Seconds until the description in a parameter is looked for again.
_LOOK_S = 5.0
_NAN = math.nan
_UNKNOWN = JointLimits("")
_NO_DESCRIPTION = "no robot description yet"


def _share(value: float, lower: float, upper: float) -> float:
    """Return where a position is from `lower` (0) to `upper` (1); NaN without a range."""
    return (value - lower) / (upper - lower) if upper > lower else _NAN


class JointTopic(MergedTopic):
    """Merges ``sensor_msgs/JointState`` with a URDF's limits. See its page in ``docs/controls``."""

    ROLES = (
        "name", "type", "position", "velocity", "effort", "lower", "upper", "share", "nearness",
        "maxEffort", "maxVelocity", "fault", "silent",
    )  # fmt: skip
    # Not fewer: a slow publisher beside a fast one must not seem silent.
    _DEFAULT_QOS = QoS(depth=100)

    #: The robot's description, URDF; empty to look for the parameter robot_description in ROS 1.
    description = Writable(str, "", then="_read_limits")
    #: "limit" for the joints nearest to a limit first, "name", or "message".
    sort = Writable(str, "limit", one_of("limit", "name", "message"), then="_sort_again")
    #: Seconds without a report after which a joint counts as silent.
    silentAfter = Writable(float, 3.0, within(0.1, 86_400, "seconds"), then="_arrange")
    #: Number of joints; of those with limits, at or beyond one of them, and silent.
    total = ReadOnly(int, 0)
    limited = ReadOnly(int, 0)
    beyond = ReadOnly(int, 0)
    silent = ReadOnly(int, 0)
    #: Joints that are not kept, because there are too many.
    omitted = ReadOnly(int, 0)
    #: Why the limits are not known, in words; empty if they are.
    limitsProblem = ReadOnly(str, _NO_DESCRIPTION)

    _description: str
    _sort: str

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        super().__init__(parent, runtime)
        self._types = ["sensor_msgs/msg/JointState"]
        self._joints: dict[str, JointLimits] = {}
        self._order_now: list[str] = []
        self._sorted_at = self._looked_at = -math.inf
        self._count = 0
        #: The newest messages that are not in the rows yet, by the names of their joints.
        self._newest: dict[tuple[str, ...], tuple[Message, float]] = {}

    # Limits.

    def _read_limits(self) -> None:
        text = self._description
        if not text:
            self._take_limits(({}, _NO_DESCRIPTION))
        elif self._session is not None:

            def done(result: Any) -> None:
                if is_alive(self) and text == self._description:
                    self._take_limits(result)

            self._session.background(lambda: read_joint_limits(text, "robot_description"), done)

    def _take_limits(self, result: tuple[dict[str, JointLimits], str] | Error) -> None:
        if isinstance(result, Error):
            report(self, limitsProblem=str(result))
            return
        self._joints, problem = result
        report(self, limitsProblem=problem)
        for row in self._rows.values():
            self._judge(row)
        self._sort_again()

    def _find_session(self) -> bool:
        found = super()._find_session()
        if found:
            self._read_limits()
        return found

    def _look_for_parameter(self, now: float) -> None:
        """Read the description from ROS 1's parameter server."""
        server = getattr(self.node, "parameter_server", None)
        if server is None or self._description or self._joints or now - self._looked_at < _LOOK_S:
            return
        self._looked_at = now
        name = self._get_namespace().rstrip("/") + "/robot_description"

        def done(result: Any) -> None:
            if is_alive(self) and not isinstance(result, Exception):
                self._take_limits(result)

        assert self._session is not None
        self._session.background(lambda: read_joint_limits(str(server.get(name)), name), done)

    # Joints.

    def _merge(self, message: Message, now: float) -> None:
        self._newest[tuple(message.name)] = (message, now)

    def _arrange(self) -> None:
        newest, self._newest = self._newest, {}
        for names, (message, at) in newest.items():
            self._take(names, message, at)
        super()._arrange()

    def _take(self, names: tuple[str, ...], message: Message, now: float) -> None:
        columns = [message.position, message.velocity, message.effort]
        fault = ""
        for what, column in zip(("position", "velocity", "effort"), columns, strict=True):
            if len(column) not in {0, len(names)}:
                fault = f"{what} has {len(column)} values for {len(names)} joints"
        values = [column.tolist() if hasattr(column, "tolist") else column for column in columns]
        rows, refused = self._rows, max(0, len(names) - _MAX_JOINTS)
        for at, name in enumerate(names[:_MAX_JOINTS]):
            row = rows.get(name)
            if row is None:
                if len(rows) >= _MAX_JOINTS:
                    refused += 1
                    continue
                self._count += 1
                row = rows[name] = {"key": name, "name": bounded(name, 200) or "?", "at": now}
                row["number"] = self._count
            row["position"], row["velocity"], row["effort"] = (
                column[at] if at < len(column) else _NAN for column in values
            )
            row["at"], row["fault"] = now, fault
            self._judge(row)
        report(self, omitted=refused)

    def _judge(self, row: dict[str, Any]) -> None:
        """Compare a joint with its limits."""
        joint = self._joints.get(row["key"], _UNKNOWN)
        row["type"], row["lower"], row["upper"] = joint.type, joint.lower, joint.upper
        row["share"] = share = _share(row["position"], joint.lower, joint.upper)
        row["nearness"] = min(share, 1 - share)
        row["maxEffort"], row["maxVelocity"] = joint.effort, joint.velocity

    def _order(self, now: float) -> dict[Any, dict[str, Any]]:
        self._look_for_parameter(now)
        limit, silent, beyond, limited = self.silentAfter, 0, 0, 0
        for row in self._rows.values():
            age = now - row["at"]
            row["silent"] = round(age) if age > limit else -1
            silent += age > limit
            limited += not math.isnan(row["lower"])
            beyond += row["nearness"] <= 0
        report(self, total=len(self._rows), silent=silent, beyond=beyond, limited=limited)
        if now - self._sorted_at > _SORT_S or len(self._order_now) != len(self._rows):
            self._sorted_at = now
            self._order_now = self._sorted()
        return {name: self._rows[name] for name in self._order_now}

    def _sorted(self) -> list[str]:
        rows = self._rows
        if self._sort == "message":
            return sorted(rows, key=lambda name: rows[name]["number"])
        if self._sort == "name":
            return sorted(rows)

        def nearness(name: str) -> tuple[float, str]:
            # Rounded, or rows would change places at the slightest movement.
            near = rows[name]["nearness"]
            return (math.inf if math.isnan(near) else round(max(near, -1.0), 2), name)

        return sorted(rows, key=nearness)

    def _sort_again(self) -> None:
        self._sorted_at = -math.inf
        self._arrange()

    def _forget(self) -> None:
        super()._forget()
        self._order_now = []
        self._newest = {}
        if not self._description:  # of a parameter of another robot
            self._joints, self._looked_at = {}, -math.inf
        report(self, omitted=0)
