"""A robot and an operator on two machines: network namespaces that a cable (veth) connects.

A test runs a script by the fixture ``on_two_machines``: the script is the operator's machine, and
makes the robot's with :class:`Cable`. What it sees, it prints as JSON on its last line.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from waiting import eventually

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["HERE", "ROBOT", "THERE", "Cable", "do"]

#: The operator's and the robot's address.
HERE, THERE = "10.77.0.1", "10.77.0.2"
#: A program of a robot of ROS 2: ``ROBOT.format(url)``, after what its URL needs.
ROBOT = """
import time, rosglass
node = rosglass.connect("{}", "robot")
node.create_service_server("/add", "example_interfaces/srv/AddTwoInts",
                           lambda request: {{"sum": request.a + request.b}})
latched = node.create_publisher("/map", "std_msgs/msg/String", rosglass.QoS.latched())
latched.publish(data="hall")
numbers = node.create_publisher("/count", "geometry_msgs/msg/Twist")
print("ready", flush=True)
number = 0
while True:
    numbers.publish(linear={{"x": number}})
    number += 1
    time.sleep(0.02)
"""


class Cable:
    """The robot's machine, and the cable to it; both are gone when it is closed."""

    def __init__(self) -> None:
        # The machine lives as long as this process, which holds its namespace.
        self._machine = subprocess.Popen(["unshare", "-n", "cat"], stdin=subprocess.PIPE)
        self._programs: list[subprocess.Popen[bytes]] = []
        own = Path("/proc/self/ns/net").readlink()
        its = Path(f"/proc/{self._machine.pid}/ns/net")
        eventually(lambda: its.readlink() != own)
        self._there = ["nsenter", "-t", str(self._machine.pid), "-n"]
        do("ip link set lo up")
        self.do_there("ip link set lo up")
        self._lay(self._machine.pid)

    def _lay(self, machine: int) -> None:
        """Connect this machine and that whose namespace a process holds."""
        do(f"ip link add cable type veth peer name cable netns {machine}")
        do(f"ip addr add {HERE}/24 dev cable")
        self.do_there(f"ip addr add {THERE}/24 dev cable")
        self.do_there("ip link set cable up")
        self.plug()

    def plug(self) -> None:
        """Connect the machines."""
        do("ip link set cable up")

    def unplug(self) -> None:
        """Cut the connection."""
        do("ip link set cable down")

    def start(
        self, *command: str, env: Mapping[str, str] | None = None, ready: str = ""
    ) -> subprocess.Popen[bytes]:
        """Start a program on the robot's machine; killed with it.

        Args:
            command: The program and its arguments.
            env: Its environment; this one's unless given.
            ready: The first line that it prints, which is waited for; empty to wait for nothing.
        """
        made = subprocess.Popen([*self._there, *command], stdout=subprocess.PIPE, env=env)
        self._programs.append(made)
        assert made.stdout is not None
        if ready:
            line = made.stdout.readline().decode()
            assert line == f"{ready}\n", f"{command}: {line!r}"
        return made

    def close(self) -> None:
        """End all programs, and the machine."""
        for program in self._programs:
            program.kill()
        self._machine.kill()

    def __enter__(self) -> Cable:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def do_there(self, command: str) -> None:
        """Run a command on the robot's machine."""
        subprocess.run([*self._there, *command.split()], check=True)


def do(command: str) -> None:
    """Run a command on this machine."""
    subprocess.run(command.split(), check=True)
