"""The demo's cockpit in a process of its own, asked and operated through its standard streams.

As a program: ``demo_driver.py URL`` shows the cockpit and answers one JSON request per line.
As a module: :class:`CockpitProcess` starts it and wraps the requests.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

SIZE = (1000, 640)


class CockpitProcess:
    """A cockpit on a display; every method waits for the answer."""

    def __init__(self, url: str, display: str) -> None:
        environment = {
            **os.environ,
            "DISPLAY": display,
            "QT_QPA_PLATFORM": "xcb",
            # The tests read the frame that the operator would see, from the same renderer.
            "QSG_RENDER_LOOP": "threaded",
            "QT_LOGGING_RULES": "qt.multimedia.*=false",
        }
        self._said: list[str] = []
        self._process = subprocess.Popen(
            [sys.executable, __file__, url],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            text=True,
        )
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()
        self._ask("ready")

    def get(self, item: str, name: str) -> Any:
        """Return a property of a part of the cockpit, such as ``scene.robotX`` of the map."""
        return self._ask("get", item, name)

    def call(self, item: str, method: str, *arguments: float) -> None:
        """Call one of its JavaScript functions."""
        self._ask("call", item, method, *arguments)

    def key(self, action: str, key: str) -> None:
        """Press or release a key: ``Key_W``."""
        self._ask("key", action, key)

    def repeat(self, key: str, times: int) -> None:
        """Repeat a key 25 times a second as X11 does at worst: released and pressed, unmarked."""
        for _ in range(times):
            self._ask("repeat", key)
            time.sleep(0.04)

    def mouse(self, action: str, item: str, x: float, y: float) -> None:
        """Press, move or release the left button, at shares of the item's size."""
        self._ask("mouse", action, item, x, y)

    def touch(self, *fingers: tuple[str, int, str, float, float]) -> None:
        """Move fingers at once: (action, finger, item, x, y)."""
        self._ask("touch", *fingers)

    def resize(self, width: int, height: int) -> None:
        """Give the window another size, whatever its least one is."""
        self._ask("resize", width, height)

    def place(self, item: str) -> tuple[float, float, float, float]:
        """Return where a part is in the window: left, top, right, bottom."""
        x, y, width, height = self._ask("place", item)
        return x, y, x + width, y + height

    def cover(self, covered: bool) -> None:
        """Let another window take the keyboard, or give it back."""
        self._ask("cover", covered)

    def grab(self, path: Path) -> None:
        """Save what the window shows."""
        self._ask("grab", str(path))

    def until(self, item: str, name: str, wanted: Any = True, timeout: float = 30.0) -> float:
        """Wait until a property has a value; returns how long it took, seconds."""
        from waiting import eventually  # this file is a program as well, without tests' paths

        begin = time.monotonic()
        eventually(
            lambda: self.get(item, name) == wanted,
            lambda: f"{item}.{name} is {self.get(item, name)!r}, not {wanted!r}",
            timeout=timeout,
        )
        return time.monotonic() - begin

    def complaints(self) -> list[str]:
        """Return what Qt and QML complained about so far."""
        words = ("QML", "QFont", ".qml:", "Warning", "Error")
        return [line for line in self._said if any(word in line for word in words)]

    def close(self) -> int:
        """End it; returns its exit code."""
        if self._process.poll() is None:
            assert self._process.stdin is not None
            self._process.stdin.close()
            try:
                self._process.wait(30)
            except subprocess.TimeoutExpired:
                self._process.kill()
        return self._process.wait()

    def _listen(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._said.append(line.rstrip())
            sys.stderr.write(line)

    def _ask(self, *request: Any) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, f"the cockpit ended with code {self._process.wait()} during {request}"
        answer = json.loads(line)
        assert "error" not in answer, answer.get("error")
        return answer["value"]


class _Driver:
    def __init__(self, url: str) -> None:
        from PySide6 import QtCore, QtGui, QtTest

        from rosglass.demo.app import Cockpit

        self._core, self._gui, self._test = QtCore, QtGui, QtTest.QTest
        self.cockpit = Cockpit(url, SIZE)
        self._finger = self._test.createTouchDevice()
        self._other = QtGui.QWindow()
        self._other.resize(50, 50)

    def handle(self, request: list[Any]) -> Any:
        return getattr(self, request[0])(*request[1:])

    def ready(self) -> bool:
        return True

    def get(self, item: str, name: str) -> Any:
        value = self.cockpit.item(item)
        for part in name.split("."):
            value = value.property(part)
        if hasattr(value, "toVariant"):
            value = value.toVariant()
        if isinstance(value, (self._core.QRectF, self._core.QRect)):
            return [value.x(), value.y(), value.width(), value.height()]
        return value

    def call(self, item: str, method: str, *arguments: float) -> None:
        wrapped = [self._core.Q_ARG("QVariant", argument) for argument in arguments]
        direct = self._core.Qt.ConnectionType.DirectConnection
        self._core.QMetaObject.invokeMethod(self.cockpit.item(item), method, direct, *wrapped)

    def key(self, action: str, key: str) -> None:
        act = self._test.keyPress if action == "press" else self._test.keyRelease
        act(self.cockpit.window, getattr(self._core.Qt.Key, key))

    def repeat(self, key: str) -> None:
        # As from the X server: the press waits in the queue, however busy the program is.
        loop, pressed = self._core.QEventLoop(), []

        def press() -> None:
            self.key("press", key)
            pressed.append(key)
            loop.quit()

        self._core.QTimer.singleShot(4, press)
        # Handles what has waited, which may be the press already.
        self.key("release", key)
        if not pressed:
            loop.exec()

    def mouse(self, action: str, item: str, x: float, y: float) -> None:
        point = self._point(item, x, y)
        left = self._core.Qt.MouseButton.LeftButton
        window, modifiers = self.cockpit.window, self._core.Qt.KeyboardModifier.NoModifier
        if action == "move":
            self._test.mouseMove(window, point)
        else:
            act = self._test.mousePress if action == "press" else self._test.mouseRelease
            act(window, left, modifiers, point)

    def touch(self, *fingers: tuple[str, int, str, float, float]) -> None:
        event = self._test.touchEvent(self.cockpit.window, self._finger)
        for action, finger, item, x, y in fingers:
            getattr(event, action)(finger, self._point(item, x, y), self.cockpit.window)
        event.commit()

    def resize(self, width: int, height: int) -> None:
        self.cockpit.window.setMinimumSize(self._core.QSize(1, 1))
        self.cockpit.window.resize(width, height)

    def place(self, item: str) -> Any:
        found = self.cockpit.item(item)
        corner = found.mapToScene(self._core.QPointF(0, 0))
        return [corner.x(), corner.y(), found.property("width"), found.property("height")]

    def cover(self, covered: bool) -> None:
        self._other.setVisible(covered)
        (self._other if covered else self.cockpit.window).requestActivate()

    def grab(self, path: str) -> None:
        self.cockpit.screenshot(Path(path))

    def _point(self, item: str, x: float, y: float) -> Any:
        found = self.cockpit.item(item)
        width, height = found.property("width"), found.property("height")
        return found.mapToScene(self._core.QPointF(x * width, y * height)).toPoint()


def main() -> int:
    driver = _Driver(sys.argv[1])
    executor = driver.cockpit.session.executor

    def answer(line: str) -> None:
        try:
            result = {"value": driver.handle(json.loads(line))}
        except Exception as error:
            result = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(result), flush=True)

    def listen() -> None:
        for line in sys.stdin:
            executor.post(lambda line=line: answer(line))
        executor.post(driver.cockpit.window.close)

    threading.Thread(target=listen, daemon=True).start()
    code = driver.cockpit.run()
    driver.cockpit.close()
    return code


if __name__ == "__main__":
    sys.exit(main())
