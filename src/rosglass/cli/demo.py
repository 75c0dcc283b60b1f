"""``rosglass demo``: router, robot and cockpit, with one command."""

from __future__ import annotations

import os
import re
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.demo.processes import DUPLICATE_EXIT, VirtualScreen, start_robot
from rosglass.errors import Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.wires.zenoh.options import ZenohOptions, locator, shown_url

if TYPE_CHECKING:
    import argparse

    from rosglass.demo.app import Cockpit
    from rosglass.demo.processes import Child

__all__ = ["run"]

#: Seconds until the demo ends where there is no display.
_HEADLESS_DURATION_S = 20.0
#: Size in pixels of the virtual screen.
_SIZE = (1340, 800)


def run(args: argparse.Namespace) -> int:
    """Run the demo; returns 1 if camera or odometry never arrived."""
    if args.seconds is not None and not 1 <= args.seconds <= 86400:
        raise Error(f"--seconds {args.seconds:g}: expected 1 to 86400")
    if not args.url.lower().startswith(("dds:", "zenoh:")):
        raise Error(f"--url {shown_url(args.url)}: expected dds:// or zenoh://HOST:PORT")
    # Checked before anything is started, so that nothing is left running.
    from rosglass.qt import QT6  # noqa: PLC0415

    if not QT6:
        raise UnsupportedError(
            f"the demo's cockpit needs Qt 6: {install_command('qml')} (inside RViz's Python there "
            "is Qt 5; use another virtual environment)"
        )

    headless = args.headless or not _has_display()
    seconds = args.seconds
    screenshot = None if args.screenshot is None else Path(args.screenshot)
    if headless:
        seconds = _HEADLESS_DURATION_S if seconds is None else seconds
        screenshot = screenshot or Path("demo.png")
    with ExitStack() as stack:
        if headless:
            _use_virtual_screen(stack, seconds)
        url = _find_router(stack, args.url)
        robot = None if args.no_robot else _start_robot(stack, url)
        from rosglass.demo.app import Cockpit  # noqa: PLC0415 - while the robot starts

        cockpit = Cockpit(url, _SIZE if headless else None)
        stack.callback(cockpit.close)
        return _show(cockpit, robot, seconds, screenshot, headless)


def _show(
    cockpit: Cockpit,
    robot: Child | None,
    seconds: float | None,
    screenshot: Path | None,
    headless: bool,
) -> int:
    failures: list[Error] = []
    taken: list[Path] = []

    def shoot() -> None:
        assert screenshot is not None
        try:
            cockpit.screenshot(screenshot)
            taken.append(screenshot.resolve())
        except Error as error:
            failures.append(error)

    if headless:
        cockpit.fly()

    def is_duplicate() -> bool:
        return robot is not None and robot.poll() == DUPLICATE_EXIT

    def leave_duplicate() -> None:
        if is_duplicate():
            cockpit.window.close()

    for half in range(1, 20):
        cockpit.at(half / 2, leave_duplicate)
    if screenshot is not None and seconds is not None:
        cockpit.at(max(0.5, seconds - 1.5), shoot)
    code = cockpit.run(seconds)
    if is_duplicate():
        # The robot has printed the reason. The cockpit displays and drives another one.
        return 1
    if screenshot is not None and seconds is None:
        shoot()
    print(f"\n{cockpit.report()}", flush=True)
    for path in taken:
        print(f"screenshot of the cockpit: {path}")
    if screenshot is not None and not taken and not failures:
        failures.append(Error(f"{screenshot} was not written: the cockpit was ended before"))
    if robot is not None and robot.poll() is not None:
        print(f"the robot (process {robot.pid}) had ended with code {robot.poll()}")
    for error in failures:
        print(f"rosglass: {error}", file=sys.stderr)
    missing = [
        what
        for what, came in (
            ("camera image", cockpit.camera.frames > 0),
            ("odometry", cockpit.received("/odom")),
        )
        if not came
    ]
    if missing:
        print(
            f"rosglass: no {' and no '.join(missing)} ever arrived; {cockpit.session.detail}",
            file=sys.stderr,
        )
    return code or int(bool(missing or failures))


def _has_display() -> bool:
    if not sys.platform.startswith("linux"):
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))


def _use_virtual_screen(stack: ExitStack, seconds: float | None) -> None:
    screen = VirtualScreen(*_SIZE)
    stack.callback(screen.close)
    os.environ["DISPLAY"] = screen.display
    os.environ["QT_QPA_PLATFORM"] = "xcb"
    print(
        f"no display: the cockpit runs {seconds:g} s on a virtual screen (Xvfb {screen.display}) "
        "and drives by itself",
        flush=True,
    )


def _find_router(stack: ExitStack, url: str) -> str:
    """Return the URL to use, after starting a router on this machine if there is no answer."""
    from rosglass.wires.zenoh.router import Router, is_router_reachable  # noqa: PLC0415 - an extra

    if url.lower().startswith("dds:"):
        return url  # where nodes find each other without one
    shown = shown_url(url)
    if is_router_reachable(url):
        print(f"using the Zenoh router at {shown}", flush=True)
        return url
    options = ZenohOptions.parse(url, os.environ)
    host = options.host or "127.0.0.1"
    if not re.fullmatch(r"localhost|127(\.\d+){3}|::1", host):
        print(f"no Zenoh router at {shown} yet: the cockpit keeps trying", flush=True)
        return url
    config = os.environ.get("ZENOH_ROUTER_CONFIG_URI") or None
    if config is None and (options.user or options.tls):
        fix = "start one that has the user or the certificate: rosglass router --config FILE"
        raise Error(f"no Zenoh router at {shown}; {fix}")
    router = Router(locator(host, options.port, "tls" if options.tls else "tcp"), config)
    stack.callback(router.close)
    print(f"no Zenoh router at {shown}: started one, on {router.listen}", flush=True)
    return url


def _start_robot(stack: ExitStack, url: str) -> Child:
    robot = start_robot(url)
    stack.callback(robot.close)
    print(
        f"started the robot, process {robot.pid}; to see how the cockpit takes its loss: "
        f"kill -9 {robot.pid}, and then: rosglass robot --url '{shown_url(url)}'",
        flush=True,
    )
    return robot
