"""A screen that steers a robot, and every way to let go of it; for the test and the benchmark.

As a program, ``letting_go.py FILE URL`` shows the screen and runs lines of its standard input. As a
module, :class:`Screen` starts it, :class:`Robot` keeps what arrives, :data:`WAYS` are the ways.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from waiting import eventually, nothing_happens

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

#: Size of the window, which is at the upper left of the screen; and the stick in it.
_SIZE, _STICK = (600, 400), (100, 100)
#: The stick in a second window.
_SECOND_STICK = (750, 300)
#: X11's code of the key Up in the keypad, which is the 8 with Num Lock.
_KEYPAD_UP = 80
#: Seconds without a message after which nothing is sent any more: zeros are up to 0.1 s apart.
_SILENCE_S = 0.5
#: Controls of a virtual gamepad, as in virtual_pads.py, which needs SDL.
LEFT_SHOULDER, LEFT_Y = 9, 1
SCREEN = """import QtQuick 2.15
import QtQuick.Window 2.15
import QtQuick.Templates 2.15 as T
import Ros2 1.0
import RosControls 1.0

Window {
    id: window
    objectName: "window"
    title: "teleoperation"
    x: 0; y: 0; width: 600; height: 400
    visible: true
    property int version: 1
    Component.onCompleted: Ros2.init("screen")
    TwistCommand {
        id: drive
        objectName: "command"
        topic: "cmd_vel"; acceleration: 0; deceleration: 0; turnAcceleration: 0
        onHalted: function (reason) { console.log("HALTED " + reason) }
    }
    Item {
        id: page
        objectName: "page"
        anchors.fill: parent
        DriveStick { objectName: "stick"; width: 200; height: 200; command: drive }
        DriveKeys { objectName: "keys"; x: 300; y: 200; command: drive }
        Loader {
            id: loader
            objectName: "loader"
            x: 300; width: 100; height: 100
            sourceComponent: Item { objectName: "code" }
        }
    }
    // An input made of code, which steers until it is released.
    property bool pushed: false
    property bool wrong: false
    Timer {
        interval: 40; repeat: true; running: window.pushed; triggeredOnStart: true
        onTriggered: {
            if (loader.item)
                drive.steer(loader.item, 1, 0)
            if (window.wrong)
                nothing.here()
        }
    }
    onPushedChanged: if (!pushed && loader.item) drive.release(loader.item)
    // Seconds to compute for, from the event loop.
    property real work: 0
    Timer {
        interval: 1; running: window.work > 0
        onTriggered: {
            const end = Date.now() + 1000 * window.work
            window.work = 0
            while (Date.now() < end) ;
        }
    }
    T.Popup { id: popup; objectName: "popup"; modal: true; x: 250; width: 50; height: 50 }
    Loader { objectName: "pads"; active: false; sourceComponent: Gamepad { command: drive } }
    Loader {
        objectName: "panels"
        active: false
        sourceComponent: Window {
            objectName: "panel"
            x: 650; y: 200; width: 200; height: 200; visible: true; title: "panel"
            DriveStick { width: 200; height: 200; command: drive }
        }
    }
    Window { objectName: "other"; x: 620; width: 100; height: 100; title: "other" }
    Window {
        objectName: "dialog"
        x: 620; width: 100; height: 100
        modality: Qt.ApplicationModal; transientParent: window
    }
}
"""


@contextmanager
def stays_connected(display: str) -> Iterator[None]:
    """Show the window of another program, as an X server begins anew without a client."""
    command = ["xlogo", "-geometry", "60x60+700+300"]
    client = subprocess.Popen(
        command, env={**os.environ, "DISPLAY": display}, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        client.kill()
        client.wait()


@contextmanager
def busy_cores(busy: bool = True) -> Iterator[None]:
    """Keep all cores busy by other processes, if `busy`."""
    count = (os.cpu_count() or 1) if busy else 0
    made = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in made:
            process.kill()
            process.wait()


class Robot:
    """Keeps what arrives at a robot: the time, by the system's steady clock, and the speed."""

    def __init__(self, node: Any, topic: str = "/cmd_vel") -> None:
        self.received: list[tuple[float, float]] = []
        self.subscription = node.create_subscription(
            topic, "geometry_msgs/msg/Twist", self._on_message
        )

    def _on_message(self, message: Any) -> None:
        now = time.monotonic()
        self.received.append((now, abs(message.linear.x) + abs(message.angular.z)))

    @property
    def moves(self) -> bool:
        """True while it moves."""
        return bool(self.received) and self.received[-1][1] > 0

    @property
    def zeros(self) -> int:
        """The number of zeros since it moved last."""
        count = 0
        for _, speed in reversed(self.received):
            if speed:
                break
            count += 1
        return count

    def last_motion(self) -> float:
        """Return when it was moved last."""
        return max((at for at, speed in self.received if speed), default=0.0)


class Screen:
    """The program; every request returns when it was carried out, by the steady clock."""

    def __init__(self, url: str, display: str, folder: Path) -> None:
        self.display, self.file = display, folder / "Main.qml"
        self.file.write_text(SCREEN)
        self._env = {**os.environ, "DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
        self._env |= {"PYTHONUNBUFFERED": "1", "QT_QUICK_BACKEND": "software"}
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(self.file), url],
            env=self._env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
        )
        # One for all input: starting another one takes longer than what is measured.
        self._input = subprocess.Popen(
            ["xdotool", "-"], env=self._env, stdin=subprocess.PIPE, text=True, bufsize=1
        )
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._wait_until_ready(0)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    def _wait_until_ready(self, since: int) -> None:
        eventually(lambda: "READY" in self.lines[since:], lambda: self.text, timeout=60)

    def reset(self) -> None:
        """Undo what the ways to let go did."""
        self.x11("mouseup 1; keyup w; keyup", _KEYPAD_UP, "; mousemove", *_STICK)
        since = len(self.lines)
        self.ask("reset()")

        def is_ready() -> bool:
            # One of its own, which ends if the window is one that is just being destroyed.
            command = ["xdotool", "search", "--name", "teleoperation", "windowfocus"]
            subprocess.run(command, env=self._env, capture_output=True, check=False)
            return "READY" in self.lines[since:]

        eventually(is_ready, lambda: self.text, timeout=60)

    @property
    def text(self) -> str:
        """All that it has written."""
        return "\n".join(self.lines)

    def ask(self, request: str) -> float:
        """Have a line of Python run on the GUI thread; return when it began."""
        assert self._process.stdin is not None
        count = len(self.lines)
        self._process.stdin.write(f"{request}\n")
        self._process.stdin.flush()

        def began() -> float:
            found = [line for line in self.lines[count:] if line.startswith("BEGIN ")]
            return float(found[0].split()[1]) if found else 0.0

        return float(eventually(began, lambda: self.text, turn=lambda: time.sleep(0.001)))

    def x11(self, *words: object) -> float:
        """Give a command to xdotool; return when it was given."""
        assert self._input.stdin is not None
        began = time.monotonic()
        for word in " ".join(map(str, words)).split(";"):
            self._input.stdin.write(f"{word.strip()}\n")
        self._input.stdin.flush()
        return began

    def signal(self, number: int) -> float:
        """Send a signal to the program."""
        began = time.monotonic()
        self._process.send_signal(number)
        return began

    def is_running(self) -> bool:
        """Return whether the program runs."""
        return self._process.poll() is None

    def close(self) -> None:
        """End it in any case."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(10)
        self._reader.join(5)
        self._input.kill()
        self._input.wait(10)


# -- holding, and letting go ---------------------------------------------------------------------


def drag(screen: Screen) -> None:
    """Pull the stick ahead with the mouse."""
    x, y = _STICK
    screen.x11("mousemove", x, y, "; mousedown 1; mousemove", x, y - 60)


def press(screen: Screen) -> None:
    """Hold W."""
    screen.x11("keydown", "w")


def press_keypad(screen: Screen) -> None:
    """Hold the key Up in the keypad."""
    screen.x11("keydown", _KEYPAD_UP)


def push(screen: Screen) -> None:
    """Steer by code."""
    screen.ask("set('window', 'pushed', True)")


def touch(screen: Screen) -> None:
    """Pull the stick ahead with a finger."""
    screen.ask("touch('press', 100, 100)")
    screen.ask("touch('move', 100, 40)")


def drag_in_panel(screen: Screen) -> None:
    """Pull the stick in a second window ahead."""
    screen.ask("set('panels', 'active', True); panel().requestActivate()")
    nothing_happens(0.2)
    x, y = _SECOND_STICK
    screen.x11("mousemove", x, y, "; mousedown 1; mousemove", x, y - 60)


def pull_pad(screen: Screen) -> None:
    """Plug a gamepad in, press its dead-man button, and push its stick ahead."""
    screen.ask("plug()")
    nothing_happens(1.0)  # until it counts
    screen.ask("pull()")


class Way(NamedTuple):
    """A way to let go.

    Attributes:
        hold: How the robot is steered before.
        let_go: Does it; returns when it began.
        ends: Whether the program ends by it.
        limit_s: Seconds within which the last motion is sent.
    """

    hold: Callable[[Screen], None]
    let_go: Callable[[Screen], float]
    ends: bool = False
    limit_s: float = 0.05


def _asks(request: str) -> Callable[[Screen], float]:
    return lambda screen: screen.ask(request)


def _sends(number: int) -> Callable[[Screen], float]:
    return lambda screen: screen.signal(number)


def _reload(screen: Screen) -> float:
    since = len(screen.lines)
    screen.file.write_text(SCREEN.replace("version: 1", f"version: {since}"))

    def began() -> float:
        found = [line for line in screen.lines[since:] if line.startswith("RELOADING ")]
        return float(found[0].split()[1]) if found else 0.0

    return float(eventually(began, turn=lambda: time.sleep(0.001)))


def _stop_and_continue(screen: Screen) -> float:
    began = screen.signal(signal.SIGSTOP)
    nothing_happens(1.0)
    screen.signal(signal.SIGCONT)
    return began


def _focus_other(screen: Screen) -> float:
    """Not found by the one xdotool for all input: it would send keys there from then on."""
    command = ["xdotool", "search", "--sync", "--onlyvisible", "--class", "xlogo"]
    env = {**os.environ, "DISPLAY": screen.display}
    found = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    return screen.x11("windowfocus", found.stdout.split()[0])


def _release_with_num_lock(screen: Screen) -> float:
    """The key has another name when it is released."""
    screen.x11("key Num_Lock")
    nothing_happens(0.1)
    began = screen.x11("keyup", _KEYPAD_UP)
    nothing_happens(0.1)
    screen.x11("key Num_Lock")
    return began


def _grab_keyboard(screen: Screen) -> float:
    """Another program grabs the keyboard for a moment, in which the key is released."""
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = x11.XDefaultRootWindow.restype = ctypes.c_void_p
    display = ctypes.c_void_p(x11.XOpenDisplay(screen.display.encode()))
    root = ctypes.c_void_p(x11.XDefaultRootWindow(display))
    began = time.monotonic()
    assert x11.XGrabKeyboard(display, root, False, 1, 1, ctypes.c_ulong(0)) == 0
    screen.x11("keyup w")
    time.sleep(0.03)
    x11.XUngrabKeyboard(display, ctypes.c_ulong(0))
    x11.XCloseDisplay(display)
    return began


def _second_input(screen: Screen) -> float:
    """A second input does not change what the first one does; letting go of the first halts."""
    screen.ask("set('window', 'pushed', True)")
    nothing_happens(0.2)
    return screen.x11("mouseup", 1)


WAYS: dict[str, Way] = {
    "stick released": Way(drag, lambda screen: screen.x11("mouseup", 1)),
    "key released": Way(press, lambda screen: screen.x11("keyup", "w")),
    "released with Num Lock": Way(press_keypad, _release_with_num_lock),
    "keyboard grabbed": Way(press, _grab_keyboard),
    "touch cancelled": Way(touch, _asks("touch('cancel', 100, 40)")),
    "pointer grab lost": Way(drag, _asks("item('touch').ungrabMouse()")),
    "dead-man released": Way(push, _asks("set('window', 'pushed', False)")),
    "focus lost": Way(press, _asks("item('other').show(); item('other').requestActivate()")),
    "focus to another program": Way(press, _focus_other),
    "window hidden": Way(drag, _asks("item('window').hide()")),
    "window minimised": Way(drag, _asks("item('window').showMinimized()")),
    "tab changed": Way(press, _asks("set('page', 'visible', False)")),
    "modal dialog": Way(drag, _asks("item('dialog').show(); item('dialog').requestActivate()")),
    "modal popup": Way(press, _asks("item('popup').open()")),
    "window closed": Way(drag, _asks("item('window').close()"), ends=True),
    "interface reloaded": Way(press, _reload),
    "error in QML": Way(push, _asks("set('window', 'wrong', True)")),
    "screen frozen for 1 s": Way(drag, _asks("time.sleep(1)"), limit_s=0.2),
    "Python at work for 1 s": Way(drag, _asks("work(1)"), limit_s=0.2),
    "another robot selected": Way(drag, _asks("set('command', 'ns', '/b')")),
    "reconnected": Way(press, _asks("reconnect()")),
    "input destroyed": Way(push, _asks("set('loader', 'active', False)")),
    "suspended": Way(drag, _stop_and_continue),
    "clock changed": Way(press, _asks("change_clock(3600)")),
    "two inputs": Way(drag, _second_input),
    # Its notice covers the stick.
    "JavaScript interrupted": Way(press, _asks("set('window', 'work', 5)"), limit_s=0.2),
    "SIGINT": Way(press, _sends(signal.SIGINT), ends=True),
    "SIGTERM": Way(drag, _sends(signal.SIGTERM), ends=True),
    "second window closed": Way(drag_in_panel, _asks("panel().close()")),
    "second window destroyed": Way(drag_in_panel, _asks("set('panels', 'active', False)")),
    "topic changed": Way(drag, _asks("set('command', 'topic', 'other_vel')")),
    "gamepad released": Way(pull_pad, _asks("pads[0].button(LEFT_SHOULDER, False)")),
    "gamepad unplugged": Way(pull_pad, _asks("pads.pop().unplug()")),
    "gamepad plugged again": Way(pull_pad, _asks("plug_again()")),
    "SIGHUP": Way(drag, _sends(signal.SIGHUP), ends=True),
    "Qt.quit()": Way(press, _asks("quit()"), ends=True),
}


class Outcome(NamedTuple):
    """How it was let go.

    Attributes:
        late_s: Seconds from the event to the last motion that the robot received; negative if that
            was before.
        zeros: Zeros that followed.
        moved_after: Motions that the robot received after the first zero.
    """

    late_s: float
    zeros: int
    moved_after: int


def let_go(screen: Screen, robot: Robot, way: Way) -> Outcome:
    """Steer the robot, let go in some way, and wait until nothing is sent any more."""

    def moves() -> bool:
        """Hold it for 0.2 s; on a busy machine the screen may stand still."""
        screen.reset()
        way.hold(screen)
        nothing_happens(0.2)
        if not robot.moves:
            screen.ask("print(item('command').problem, item('stick').property('held'))")
        return robot.moves

    eventually(moves, lambda: screen.text)
    before = len(robot.received)
    began = way.let_go(screen)
    eventually(lambda: robot.zeros >= 3, lambda: (screen.text, robot.received[before:][-40:]))
    eventually(lambda: time.monotonic() - robot.received[-1][0] > _SILENCE_S)
    later = robot.received[before:]
    first = next(at for at, (_, speed) in enumerate(later) if not speed)
    moved = sum(speed > 0 for _, speed in later[first:])
    return Outcome(robot.last_motion() - began, robot.zeros, moved)


# -- the program ---------------------------------------------------------------------------------


def main(file: str, url: str) -> int:
    """Show the screen, and run the lines of the standard input on the GUI thread."""
    from rosglass.controls.steering import command_sender
    from rosglass.qml import Application
    from rosglass.qt import QtCore, QtGui

    app = Application(file, url=url, watch=True)
    app.session.longest_script = 1.0

    def note_reload() -> None:
        print(f"RELOADING {time.monotonic()}", flush=True)

    app._runner._live.due.connect(note_reload)
    app.load()
    app.window.requestActivate()

    def item(name: str) -> Any:
        window: Any = app.window
        return window if name == "window" else window.findChild(QtCore.QObject, name)

    def set_property(name: str, key: str, value: Any) -> None:
        item(name).setProperty(key, value)

    def reconnect() -> None:
        hosts = ["127.0.0.1", "localhost"]
        before, after = hosts if hosts[0] in app.session.url.partition("?")[0] else hosts[::-1]
        app.session.url = app.session.url.replace(before, after, 1)

    class Clock:
        """The module `time`, with the system's clock changed."""

        def __init__(self, step: float) -> None:
            self._step = step

        def __getattr__(self, name: str) -> Any:
            return getattr(time, name)

        def time(self) -> float:
            return time.time() + self._step

    def change_clock(step: float) -> None:
        command_sender.time = Clock(step)  # type: ignore[assignment]

    fingers: list[Any] = []

    def touch(what: str, x: int, y: int) -> None:
        from PySide6.QtTest import QTest

        device = fingers[0] if fingers else QTest.createTouchDevice()
        fingers[:] = [device]
        window: Any = app.window
        if what == "cancel":
            event = QtGui.QTouchEvent(QtCore.QEvent.Type.TouchCancel, device)
            QtCore.QCoreApplication.sendEvent(window, event)
            return
        sequence = QTest.touchEvent(window, device)
        (sequence.press if what == "press" else sequence.move)(1, QtCore.QPoint(x, y), window)
        sequence.commit()

    pads: list[Any] = []

    def plug() -> None:
        """Plug a gamepad in."""
        import sdl2
        from virtual_pads import VirtualPad

        from rosglass.controls.steering.gamepad_devices import devices

        if not sdl2.SDL_WasInit(sdl2.SDL_INIT_JOYSTICK):
            devices.listen(lambda _: None)
            set_property("pads", "active", True)
            eventually(lambda: sdl2.SDL_WasInit(sdl2.SDL_INIT_JOYSTICK))
        pads.append(VirtualPad())

    def pull() -> None:
        """Steer by it."""
        pads[0].axis(LEFT_Y, -1)
        pads[0].button(LEFT_SHOULDER)

    def plug_again() -> None:
        """Pull its plug and push it in again; it reports later that its button is held."""
        pads.pop().unplug()
        time.sleep(0.01)
        plug()
        QtCore.QTimer.singleShot(250, pull)

    def reset() -> None:
        for name, properties in {
            "window": {"pushed": False, "wrong": False, "work": 0, "visible": True},
            "page": {"visible": True},
            "popup": {"visible": False},
            "other": {"visible": False},
            "dialog": {"visible": False},
            "loader": {"active": True},
            "panels": {"active": False},
            "command": {"ns": "", "topic": "cmd_vel"},
        }.items():
            for key, value in properties.items():
                set_property(name, key, value)
        command_sender.time = time
        while pads:
            pads.pop().unplug()
        item("window").showNormal()
        item("window").requestActivate()
        timer.start(20)

    def work(seconds: float) -> None:
        """Keep Python's lock, which other threads get only by asking for it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            pass

    names = {
        "work": work,
        "panel": lambda: item("panels").property("item"),
        "pads": pads,
        "plug": plug,
        "plug_again": plug_again,
        "pull": pull,
        "LEFT_SHOULDER": LEFT_SHOULDER,
        "reset": reset,
        "item": item,
        "set": set_property,
        "touch": touch,
        "reconnect": reconnect,
        "change_clock": change_clock,
        "quit": app.engine.quit.emit,
        "time": time,
        "print": print,
    }

    def run(line: str) -> None:
        print(f"BEGIN {time.monotonic()}", flush=True)
        exec(line, names)
        print("DONE", flush=True)

    def read() -> None:
        for line in sys.stdin:
            app.session.executor.post(lambda line=line: run(line))

    def on_ready() -> None:
        sender, window = item("command")._endpoint, item("window")
        if sender and sender.publisher.subscription_count() and window.isActive():
            timer.stop()
            print("READY", flush=True)

    timer = QtCore.QTimer()
    timer.timeout.connect(on_ready)
    timer.start(20)
    threading.Thread(target=read, daemon=True).start()
    return app.run(end_process=True)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
