"""Counts the milestones of part 11, and prints them as a table.

    .venv/bin/python scripts/milestones.py [--checkout DIR] [--trace]

The first figures are read off the sources, of any checkout. ``--trace`` also runs this one: a
publisher in another process sends, and the files are counted that each message passes through,
from the socket to a subscription's callback, and to a binding in QML. Over ROS 1 that needs
Debian's rosmaster; Zenoh calls from threads that are not Python's, which no profile sees.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Underscored attributes of NamedTuples that are public.
_OF_TUPLES = {"_replace", "_asdict", "_fields", "_make"}
#: Underscored attributes of rospy's generated classes that genpy documents.
_OF_GENPY = {
    "_buff",
    "_connection_header",
    "_full_text",
    "_md5sum",
    "_request_class",
    "_response_class",
    "_slot_types",
    "_type",
}
_MESSAGES = 300
#: How long a trace may take.
_TRACE_TIMEOUT_S = 60


class Source:
    """One file of Python.

    Attributes:
        path: Where it is.
        text: What is in it.
        tree: The same, parsed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text(encoding="utf-8")
        self.tree = ast.parse(self.text)

    @property
    def lines(self) -> int:
        """How many lines it has."""
        return len(self.text.splitlines())


def read(folder: Path) -> list[Source]:
    return [Source(path) for path in sorted(folder.rglob("*.py"))]


def total_lines(sources: list[Source]) -> int:
    return sum(source.lines for source in sources)


def private_reaches(sources: list[Source]) -> int:
    """Count attributes with a leading underscore of something else than the object itself."""
    return sum(
        node.attr.startswith("_")
        and not node.attr.startswith("__")
        and node.attr not in _OF_TUPLES | _OF_GENPY
        and getattr(node.value, "id", "") not in {"self", "cls", "os", "sys", "ctypes"}
        and getattr(getattr(node.value, "func", None), "id", "") != "super"
        for source in sources
        for node in ast.walk(source.tree)
        if isinstance(node, ast.Attribute)
    )


def import_graph(package: Path, sources: list[Source]) -> dict[str, set[str]]:
    """Return which module imports which, imports for type checkers only and late ones counted."""
    names = {}
    for source in sources:
        parts = source.path.relative_to(package.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = source
    graph: dict[str, set[str]] = {}
    for name, source in names.items():
        wanted = graph[name] = set()
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Import):
                wanted |= {alias.name for alias in node.names} & names.keys()
            elif isinstance(node, ast.ImportFrom) and node.module:
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                wanted |= (inner & names.keys()) or ({node.module} & names.keys())
        wanted.discard(name)
    return graph


def cycles(graph: dict[str, set[str]]) -> tuple[int, int]:
    """Return how many groups of more than two modules import each other, and their modules.

    The groups are the strongly connected components, by Tarjan's algorithm.
    """
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    groups = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in graph[name]:
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            at = stack.index(name)
            groups.append(stack[at:])
            del stack[at:]

    sys.setrecursionlimit(10_000)
    for name in graph:
        if name not in index:
            visit(name)
    large = [group for group in groups if len(group) > 2]
    return len(large), sum(map(len, large))


def circles(graph: dict[str, set[str]]) -> int:
    """Count pairs of modules that import each other."""
    return sum(name in graph[other] for name in graph for other in graph[name]) // 2


def back_arrows(graph: dict[str, set[str]]) -> int:
    """Count pairs of packages of which each imports the other."""
    arrows = {
        (name.split(".")[1], other.split(".")[1])
        for name, wanted in graph.items()
        for other in wanted
        if name.count(".") and other.count(".")
    }
    return sum(one < other and (other, one) in arrows for one, other in arrows)


def inheritance(sources: list[Source], base: str) -> list[str]:
    """Return the longest line of classes that derive from each other, from `base` down."""
    children: dict[str, list[str]] = {}
    for source in sources:
        for node in ast.walk(source.tree):
            if isinstance(node, ast.ClassDef):
                for parent in node.bases:
                    children.setdefault(ast.unparse(parent), []).append(node.name)

    def below(name: str) -> list[str]:
        return [name, *max(map(below, children.get(name, [])), key=len, default=[])]

    return below(base)


def loaded(root: Path, module: str, package: str) -> int:
    """Count modules of a package that importing a module loads, in a process of its own."""
    code = (
        f"import sys, {module}\n"
        f"print(sum(name.split('.')[:2] == {package.split('.')!r} for name in sys.modules))"
    )
    env = {**os.environ, "PYTHONPATH": str(root / "src")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
    )
    return int(done.stdout)


def patterns(root: Path) -> int:
    """Count the finds of scripts/words.py."""
    done = subprocess.run(
        [sys.executable, root / "scripts" / "words.py"],
        capture_output=True,
        text=True,
        check=False,
    )
    return int(done.stdout.split()[-1]) if done.returncode else 0


# -- the way of a message ------------------------------------------------------------------

_PUBLISHER = """
import sys, time, rosglass
with rosglass.connect(sys.argv[1], name="milestones_talker") as node:
    publisher = node.create_publisher("/milestones", "std_msgs/msg/String", qos=1000)
    number = 0
    while True:
        number += 1
        publisher.publish({"data": str(number)})
        time.sleep(0.01)
"""
_INTERFACE = """
import QtQml
import Ros2 1.0
QtObject {
    property QtObject source: Subscription {
        topic: "/milestones"; messageType: "std_msgs/msg/String"; queueSize: 1000; throttleRate: 0
    }
    property string shown: source && source.message ? source.message.data : ""
    onShownChanged: tracer.arrived()
}
"""


class Tracer:
    """Counts the files of rosglass that every message runs through.

    Attributes:
        enough: Set once enough messages have come.
    """

    def __init__(self) -> None:
        import rosglass  # noqa: PLC0415 - of this checkout, not the one that is counted

        self.enough = threading.Event()
        self._package = str(Path(rosglass.__file__).parent) + os.sep
        self._messages_of: Counter[str] = Counter()
        #: The files called since the last message.
        self._called: set[str] = set()
        self._came = 0

    def profile(self, frame: Any, event: str, _: object) -> None:
        """Note a call; for ``sys.setprofile``."""
        if event == "call":
            self._called.add(frame.f_code.co_filename)

    def arrived(self) -> None:
        """Count a message; the first 50 settle types, links and buffers."""
        called, self._called = self._called, set()
        self._came += 1
        if 50 < self._came <= 50 + _MESSAGES:
            self._messages_of.update(called)
        elif self._came > 50 + _MESSAGES:
            self.enough.set()

    def files(self) -> list[str]:
        """Return the files, in the order of their names."""
        if not self.enough.is_set():
            raise SystemExit(f"{self._came} messages came in {_TRACE_TIMEOUT_S} s")
        often = [file for file, count in self._messages_of.items() if count >= 0.9 * _MESSAGES]
        return sorted(
            file.removeprefix(self._package) for file in often if file.startswith(self._package)
        )


@contextlib.contextmanager
def talker(url: str) -> Iterator[None]:
    """Publish 100 messages a second, in another process."""
    process = subprocess.Popen([sys.executable, "-c", _PUBLISHER, url])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def trace_callback(url: str) -> list[str]:
    """Return the files between the socket and a subscription's callback."""
    import rosglass  # noqa: PLC0415 - of this checkout, not the one that is counted

    tracer = Tracer()

    def on_message(message: rosglass.Message) -> None:
        tracer.arrived()
        message.data  # noqa: B018 - what a user does

    threading.setprofile(tracer.profile)
    with rosglass.connect(url, name="milestones_listener") as node, talker(url):
        node.create_subscription("/milestones", "std_msgs/msg/String", on_message, qos=1000)
        tracer.enough.wait(_TRACE_TIMEOUT_S)
    threading.setprofile(None)
    return tracer.files()


def trace_binding(url: str) -> list[str]:
    """Return the files between the socket and a binding to a Subscription's message in QML."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    # Of this checkout, not the one that is counted.
    from rosglass.qml import Session, install  # noqa: PLC0415
    from rosglass.qt import QtCore, QtGui, QtQml, Slot, run_event_loop  # noqa: PLC0415

    tracer = Tracer()

    class Arrivals(QtCore.QObject):
        @Slot()
        def arrived(self) -> None:
            tracer.arrived()
            if tracer.enough.is_set():
                loop.quit()

    app = QtGui.QGuiApplication.instance() or QtGui.QGuiApplication([])
    loop, arrivals, engine = QtCore.QEventLoop(), Arrivals(), QtQml.QQmlEngine()
    engine.rootContext().setContextProperty("tracer", arrivals)
    threading.setprofile(tracer.profile)
    session = install(engine, Session(url))
    session.init("milestones_interface")
    component = QtQml.QQmlComponent(engine)
    component.setData(_INTERFACE.encode(), QtCore.QUrl("file:///milestones.qml"))
    root = component.create()
    if root is None:
        raise SystemExit(component.errorString())
    QtCore.QTimer.singleShot(1000 * _TRACE_TIMEOUT_S, loop.quit)
    sys.setprofile(tracer.profile)
    with talker(url):
        run_event_loop(loop)
    sys.setprofile(None)
    threading.setprofile(None)
    session.close()
    del root, component, engine, app
    return tracer.files()


@contextlib.contextmanager
def ros1_master() -> Iterator[str]:
    """Start Debian's rosmaster; yields its URL."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as home:
        env = {"PATH": "/usr/bin:/bin", "HOME": home, "ROS_HOME": home, "ROS_IP": "127.0.0.1"}
        null = subprocess.DEVNULL
        command = ["/usr/bin/rosmaster", "--core", "-p", str(port)]
        server = subprocess.Popen(command, env=env, stdout=null, stderr=null)
        try:
            time.sleep(2)
            yield f"ros1://127.0.0.1:{port}"
        finally:
            server.kill()
            server.wait()


def traces() -> Iterator[tuple[str, str, list[str]]]:
    """Yield wire, end and files of each path."""
    with contextlib.ExitStack() as stack:
        urls = {"DDS": "dds://?domain=77"}
        if shutil.which("/usr/bin/rosmaster"):
            urls["TCPROS"] = stack.enter_context(ros1_master())
        for wire, url in urls.items():
            yield wire, "callback", trace_callback(url)
            yield wire, "QML binding", trace_binding(url)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--checkout", type=Path, default=Path(__file__).parents[1], metavar="DIR")
    parser.add_argument("--trace", action="store_true", help="run messages through, too")
    options = parser.parse_args()
    root = options.checkout.resolve()
    package = root / "src" / "rosglass"
    if not package.is_dir():
        parser.error(f"{root} is not a checkout of rosglass: {package} is missing")
    source, tests = read(package), read(root / "tests")
    graph = import_graph(package, source)
    groups, inside = cycles(graph)

    def inside_of(folder: str) -> list[Source]:
        return [one for one in source if one.path.relative_to(package).parts[0] == folder]

    def flat(folder: str) -> int:
        return sum(one.path.parent == package / folder for one in source)

    largest = max(inside_of("scene"), key=lambda one: one.lines)
    without_rviz = total_lines(source) - total_lines(inside_of("rviz"))
    rows = [
        (
            "modules of rosglass.rviz loaded by rosglass.scene.access",
            loaded(root, "rosglass.scene.access", "rosglass.rviz"),
            "0",
        ),
        ("files directly in scene/, qml/", f"{flat('scene')}, {flat('qml')}", "4, 4"),
        (f"largest file of scene/ ({largest.path.name}), lines", largest.lines, "900"),
        (
            "classes from Display to the deepest display of scene/",
            len(inheritance(inside_of("scene"), "Display")),
            "4",
        ),
        ("packages that import each other, pairs", back_arrows(graph), "0"),
        ("modules that import each other, pairs", circles(graph), "2"),
        ("import cycles of more than two modules", f"{groups} ({inside} modules)", "0"),
        ("patterns of scripts/words.py", patterns(root), "0"),
        ("tests: reaches into privates", private_reaches(tests), "60"),
        ("src without rviz/, lines", without_rviz, "105,000"),
        ("tests, lines", total_lines(tests), "78,000"),
    ]
    if options.trace:
        for wire, end, files in traces():
            limit = "8" if end == "callback" else "11"
            rows.append((f"files from socket to {end}, {wire}", len(files), limit))
            print(f"{wire} to {end}: {', '.join(files)}", file=sys.stderr)
    width = max(len(row[0]) for row in rows)
    print(f"{'':{width}}  {'now':>16}  reach")
    for what, now, reach in rows:
        print(f"{what:{width}}  {f'{now:,}' if isinstance(now, int) else now:>16}  {reach}")


if __name__ == "__main__":
    main()
