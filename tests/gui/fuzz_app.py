"""Drives every function, property and signal of our QML modules with values made to hurt.

Run by test_fuzz.py with a chunk's name, the address of a robot (``memory`` for a world without a
network) and a file, in which the last thing tried is found after a crash.
"""

from __future__ import annotations

import faulthandler
import json
import logging
import os
import sys
import time
from itertools import count
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from local_world import LocalWorld

from rosglass.qml import Session, install
from rosglass.qml.elements import ros1, ros2, services, tf_buffer
from rosglass.qml.engine.log import LocationFormatter, install_message_handler
from rosglass.qml.engine.waiting import wait_for
from rosglass.qt import QtCore, QtGui, QtQml, Slot, send_deferred_deletes

SCRIPT = Path(__file__).with_name("fuzz.js").as_uri()
MODULES: dict[str, Any] = {"Ros": ros1, "Ros2": ros2}
NUMBERS = count()
KEPT: list[Any] = []
#: Seconds that one call may take.
LIMIT = 10
#: Objects that functions of the modules return.
GIVEN = {
    "Ros2": {
        "publisher": "Ros2.createPublisher('/text', 'std_msgs/msg/String')",
        "scan publisher": "Ros2.createPublisher('/scan', 'sensor_msgs/msg/LaserScan', 5)",
        "subscription": "Ros2.createSubscription('/text', 'std_msgs/msg/String', 3)",
        "service client": "Ros2.createServiceClient('/set', 'std_srvs/srv/SetBool')",
        "service server": "Ros2.createServiceServer('/set', 'std_srvs/srv/SetBool', () => 5)",
        "action client": "Ros2.createActionClient('/act', 'example_interfaces/action/Fibonacci')",
        "logger": "Ros2.getLogger('fuzz')",
        "QoS": "Ros2.QoS()",
        "init options": "Ros2.createInitOptions()",
        "time": "Ros2.now()",
        "duration": "Ros2.duration(1)",
        "message": "Ros2.createEmptyMessage('sensor_msgs/msg/LaserScan')",
        "array": "Ros2.createEmptyMessage('sensor_msgs/msg/LaserScan').ranges",
        "io": "Ros2.io",
    },
    "Ros": {
        "publisher": "Ros.advertise('std_msgs/String', '/text', 1, true)",
        "subscriber": "Ros.subscribe('/text', 1)",
        "service server": "Ros.advertiseService('std_srvs/SetBool', '/set', () => 5)",
        "action client": "Ros.createActionClient('actionlib_tutorials/FibonacciAction', '/act')",
        "console": "Ros.console",
        "package": "Ros.package",
        "io": "Ros.io",
        "time": "Time.now()",
        "message": "Ros.createEmptyMessage('sensor_msgs/LaserScan')",
    },
}


class Host(QtCore.QObject):
    """The object that the JavaScript side gets."""

    def __init__(self, last: Path) -> None:
        super().__init__()
        self._last = os.open(last, os.O_CREAT | os.O_WRONLY)
        self._until = 0.0

    @Slot(str)
    def note(self, text: str) -> None:
        """Remember what is tried next, for when it is the end; a hang ends the process."""
        os.pwrite(self._last, text.encode().ljust(300), 0)
        now = time.monotonic()
        if now > self._until:
            # Arming starts a thread: not for each of thousands of calls.
            self._until = now + 1
            faulthandler.dump_traceback_later(LIMIT + 1, exit=True)


def spin(milliseconds: int = 0) -> None:
    until = time.monotonic() + milliseconds / 1000
    while True:
        QtCore.QCoreApplication.processEvents()
        send_deferred_deletes()
        if time.monotonic() >= until:
            return
        time.sleep(0.001)


ENUMS = {
    "ActionCommStates",
    "ActionGoalStatus",
    "ActionTerminalStates",
    "Ros2LoggerLevel",
    "RosConsoleLevels",
    "RosInitOptions",
}


def load(engine: Any, text: str, name: str) -> Any:
    # The engine remembers what is in a folder.
    file = Path.cwd() / name / "Main.qml"
    file.parent.mkdir()
    file.write_text(text)
    component = QtQml.QQmlComponent(engine, QtCore.QUrl.fromLocalFile(str(file)))
    item = component.create()
    assert item is not None, component.errorString()
    # The object would end with its component.
    KEPT.append(component)
    return item


class Fuzz:
    """One engine with a robot."""

    def __init__(self, host: Host, url: str) -> None:
        self.host = host
        if url == "memory":
            self.session = Session(connect=LocalWorld().connect)
        else:
            self.session = Session(url)
        self.engine = QtQml.QQmlEngine()
        self.engine.rootContext().setContextProperty("host", host)
        install(self.engine, self.session)

    def start(self) -> None:
        self.session.init("fuzz")
        until = time.monotonic() + LIMIT
        while self.session.node is None:
            spin(5)
            assert time.monotonic() < until, "there is no node"

    def root(self, uri: str, body: str) -> Any:
        head = f'import QtQuick 2.15\nimport {uri} 1.0\nimport "{SCRIPT}" as Fuzz\n'
        return load(self.engine, head + "Item { id: root\n" + body + "\n}", f"Fuzz{next(NUMBERS)}")

    def close(self) -> None:
        self.session.close()
        self.engine.deleteLater()
        spin(5)


def drive(
    fuzz: Fuzz, uri: str, name: str, made: str, few: bool, members: list[str] | None = None
) -> None:
    """Drive one object; `members` for one that does not list them itself."""
    words = json.dumps([name, members, few])
    body = f"""property var made: {made}
        function go() {{ Fuzz.drive(host, made, root, {words}) }}"""
    root = fuzz.root(uri, body)
    spin(10)
    root.go()
    spin(10)
    item = root.property("made")
    if not few and isinstance(item, QtCore.QObject):
        # A method that is not a slot gives the object members of its own, after which QML, which
        # remembers them by address, may miss those of the next object.
        added = members_of(item.metaObject()) - members_of(type(item).staticMetaObject)
        assert not added, f"{name}: not decorated with @Slot: {added}"
    root.deleteLater()
    spin()


def members_of(meta: Any) -> set[str]:
    """Return the names of properties, functions and signals."""
    base = QtCore.QObject.staticMetaObject
    methods = range(base.methodCount(), meta.methodCount())
    properties = range(base.propertyCount(), meta.propertyCount())
    found = {bytes(meta.method(at).name().data()).decode() for at in methods}
    return found | {str(meta.property(at).name()) for at in properties}


def singletons(fuzz: Fuzz, uri: str, few: bool) -> None:
    """Drive what is there without being made."""
    for native in MODULES[uri].NATIVE:
        name = native.removesuffix("Native")
        # On Qt 5 a singleton does not list them.
        members = sorted(members_of(MODULES[uri].NATIVE[native].staticMetaObject))
        drive(fuzz, uri, name, name, few, members)
        fuzz.start()


def given(fuzz: Fuzz, uri: str, few: bool) -> None:
    """Drive what functions return."""
    for name, made in GIVEN[uri].items():
        drive(fuzz, uri, name, made, few)


def types(fuzz: Fuzz, uri: str, few: bool) -> None:
    """Drive every element."""
    for name in MODULES[uri].TYPES:
        made = f"Qt.createQmlObject('import {uri} 1.0; {name} {{}}', root)"
        drive(fuzz, uri, name, made, few)


def lifecycle(fuzz: Fuzz, uri: str, few: bool) -> None:
    """Let callbacks throw, destroy what calls them, and shut down; make and destroy many."""
    singleton = "Ros2" if uri == "Ros2" else "Ros"
    text = "std_msgs/msg/String" if uri == "Ros2" else "std_msgs/String"
    set_bool = "std_srvs/srv/SetBool" if uri == "Ros2" else "std_srvs/SetBool"
    kinds = json.dumps([name for name in MODULES[uri].TYPES if name not in ENUMS])
    made = {
        "Ros2": f"""publisher = Ros2.createPublisher('/loop', '{text}')
            client = Ros2.createServiceClient('/set', '{set_bool}')
            server = Ros2.createServiceServer('/set', '{set_bool}', r => {{ throw new Error('s') }})
            action = Ros2.createActionClient('/a', 'example_interfaces/action/Fibonacci')""",
        "Ros": f"""publisher = Ros.advertise('{text}', '/loop', 1, false)
            client = null
            server = Ros.advertiseService('{set_bool}', '/set', r => {{ throw new Error('s') }})
            action = Ros.createActionClient('actionlib_tutorials/FibonacciAction', '/a')""",
    }[uri]
    element = "Subscription" if uri == "Ros2" else "Subscriber"
    body = f"""property var publisher; property var client; property var server; property var action
    property int heard: 0
    property var deed: () => {{}}
    Component {{ id: listener
        {element} {{ id: self; topic: "/loop"; throttleRate: 0
            onNewMessage: {{ root.heard += 1; root.deed(self); throw new Error("handler") }} }} }}
    function make() {{ {made} }}
    function listen() {{ return listener.createObject(root) }}
    function send() {{ publisher.publish({{data: "<img src='file:///etc/passwd'>"}}) }}
    function pend() {{
        {singleton}.waitForMessageAsync("/never", () => {{ throw new Error("never") }})
        const promise = {singleton}.waitForMessageAsync("/never", 1)
        const end = () => {{ {singleton}.shutdown(); throw new Error("p") }}
        if (promise) promise.then(() => {{}}, end)
        if (client) client.call({{data: true}}).then(() => {{}}, () => {{ throw new Error("p") }})
        if (client) client.sendRequestAsync({{data: true}}, () => {{ throw new Error("r") }})
        try {{ action.sendGoalAsync({{order: 3}}, fail) }} catch (e) {{}}
        try {{ action.sendGoal({{order: 3}}, fail, fail, fail) }} catch (e) {{}}
    }}
    function fail() {{ throw new Error("callback") }}
    function doom(n) {{ deed = [
        self => self.destroy(),
        self => {{ {singleton}.shutdown(); {singleton}.init("again") }},
        self => {{ self.topic = ""; self.topic = "/loop" }},
        self => {{ self.enabled = false; gc() }},
        self => root.send(),
        self => {singleton}.shutdown()][n] }}
    function many() {{
        for (const kind of {kinds})
            for (let i = 0; i < 200 / {len(json.loads(kinds))}; ++i) {{
                const item = Qt.createQmlObject(`import {uri} 1.0; ${{kind}} {{}}`, root)
                if (i % 2) item.destroy(); else Qt.callLater(() => item.destroy())
            }}
    }}"""
    for number in range(6):
        fuzz.host.note(f"lifecycle {number}")
        fuzz.start()
        root = fuzz.root(uri, body)
        root.make()
        keep = root.listen()
        root.doom(number)
        until = time.monotonic() + LIMIT
        while not root.property("heard"):
            root.send()
            spin(20)
            assert time.monotonic() < until, f"nothing was heard in round {number}"
        root.pend()
        spin(20)
        root.many()
        spin(0 if number % 2 else 20)
        del keep
        if number < 5:
            # In the last round the engine goes while everything is pending.
            root.deleteLater()
            spin(5)


def main() -> None:
    chunk, uri, url, last = sys.argv[1:]
    install_message_handler()
    logging.basicConfig(level=logging.INFO)
    logging.getLogger().handlers[0].setFormatter(LocationFormatter())
    # "Too many arguments", as meant.
    logging.getLogger("rosglass.qt").setLevel(logging.ERROR)
    for module in (services, ros1, tf_buffer):
        module.wait_for = briefly  # type: ignore[attr-defined]
    app = QtGui.QGuiApplication(["fuzz"])
    fuzz = Fuzz(Host(Path(last)), url)
    fuzz.start()
    globals()[chunk](fuzz, uri, url != "memory")
    fuzz.close()
    del app
    faulthandler.cancel_dump_traceback_later()
    print("came to the end", flush=True)


def briefly(session: Session, begin: Any) -> None:
    """Wait as calls do, but not for as long as a hostile number of milliseconds says."""

    def soon(end: Any) -> None:
        begin(end)
        QtCore.QTimer.singleShot(1, end)

    wait_for(session, soon)


if __name__ == "__main__":
    main()
