"""The arguments of every command.

The module of a command (``topic.py``) imports what it needs at its top, and is imported once the
command line has been parsed. This one imports nothing slow: ``--help`` and Tab completion need no
more.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from rosglass.cli.parser import (
    TIMEOUT_S,
    Subcommands,
    add_connection_options,
    add_definitions_option,
    add_output_options,
    complete,
    number,
    pair,
    positive_int,
    screenshot_file,
    seconds,
)

if TYPE_CHECKING:
    import argparse

__all__ = ["COMMANDS", "PLAY_KEYS", "TEMPLATES"]

#: The keys of ``rosglass play``.
PLAY_KEYS = (
    "space pauses, s sends one message, left and right jump 10 s, + and - change the rate, q ends"
)
#: Messages that ``topic hz``, ``bw`` and ``delay`` evaluate.
_WINDOW = 10_000

#: The router of ``rosglass demo`` and ``rosglass robot``, unless the environment names another.
_DEMO_URL = "zenoh://127.0.0.1:7447"

#: Help of arguments by the kind of their name.
_HELP = {
    "topics": "name of the topic, e.g. /odom",
    "services": "name of the service, e.g. /reset",
    "actions": "name of the action, e.g. /dock",
    "nodes": "name of the node, e.g. /camera",
    "lifecycle_nodes": "name of the lifecycle node, e.g. /camera",
}
_rate = number(0, 10_000, "a rate above 0 and up to 10000", above=True)
_plot_window = number(0.001, 2_592_000, "a number of seconds from 0.001 to 2592000 (30 days)")
_time_within_a_day = number(0, 86_400, "a number of seconds from 0 to 86400")


# -- what several commands have ------------------------------------------------------------------


def _add_common(parser: argparse.ArgumentParser, timeout: float | None = TIMEOUT_S) -> None:
    add_output_options(parser)
    add_connection_options(parser, timeout=timeout)


def _add_name(parser: argparse.ArgumentParser, name: str, what: str, **options: Any) -> None:
    """Declare an argument that Tab completes; `what` as for :func:`complete`."""
    options.setdefault("help", _HELP.get(what))
    complete(parser.add_argument(name, **options), what)


def _add_values(parser: argparse.ArgumentParser, example: str, types: str) -> None:
    """Declare ``[TYPE] VALUES``."""
    _add_name(parser, "rest", types, nargs="*", metavar="[TYPE] VALUES", help=example)


def _add_list_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-t", "--types", "--show-types", action="store_true", help="show types")


def _add_exclude(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument(
        "-x",
        "--exclude",
        "--exclude-regex",
        default="",
        metavar="REGEX",
        help=f"exclude matching {what}",
    )


def _add_import_paths(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-I",
        dest="import_paths",
        metavar="FOLDER",
        action="append",
        default=[],
        help="a folder with QML modules, in addition to QML_IMPORT_PATH; may be repeated",
    )


def _add_overlays(parser: argparse.ArgumentParser) -> None:
    """Declare the interfaces over a 3D view."""
    overlay = parser.add_argument(
        "--overlay",
        dest="overlays",
        metavar="FILE.qml",
        action="append",
        default=[],
        help="a QML file to show over the 3D view; package://name/path for a file in a package; "
        "may be repeated, the last one is on top",
    )
    complete(overlay, "*.qml")
    parser.add_argument(
        "--watch",
        action="store_true",
        help="reload interfaces when a file in their folders is saved",
    )
    _add_import_paths(parser)


def _add_interface_options(
    parser: argparse.ArgumentParser,
    drawn: str,
    window: str,
    after: float,
    *,
    definitions: bool = True,
) -> None:
    """Declare the options of programs that show QML.

    Args:
        parser: Parser of the command.
        drawn: The object that the renderer draws, for the help.
        window: The object of a screenshot, for the help.
        after: Default of --after, in seconds.
        definitions: Whether to declare --definitions, too.
    """
    parser.add_argument(
        "--renderer",
        choices=("auto", "opengl", "software"),
        default="auto",
        help=f"renderer of {drawn}: OpenGL, Qt's software renderer (no shaders, particles or "
        "videos), or the faster one of these (auto, the default)",
    )
    parser.add_argument(
        "--allow-network",
        action="store_true",
        help="allow the interface to load images, QML files, modules and meshes from other "
        "machines (http:)",
    )
    parser.add_argument(
        "--longest-script",
        metavar="SECONDS",
        type=seconds,
        default=5.0,
        help="interrupt JavaScript that has blocked the interface for this long; 0 for no limit "
        "(default: %(default)g)",
    )
    parser.add_argument(
        "--screenshot",
        metavar="FILE",
        type=screenshot_file,
        help=f"save a screenshot of {window} (PNG, JPEG) and exit",
    )
    parser.add_argument(
        "--after",
        metavar="SECONDS",
        type=_time_within_a_day,
        default=after,
        help="time until the screenshot (default: %(default)s)",
    )
    if definitions:
        add_definitions_option(parser)


# -- interfaces ----------------------------------------------------------------------------------


def _add_robot_url(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--url",
        default="",
        help="URL of the robot, e.g. zenoh://192.168.1.5:7447, or replay:FILE for a "
        "recording; default: ROSGLASS_URL, or ROS's own variables, or the Zenoh router "
        "or ROS 1 master of this machine",
    )


def _add_3d_view(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--fixed-frame",
        metavar="FRAME",
        default="",
        help="the fixed frame, instead of the one in the config",
    )
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")


def _add_video(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--record",
        metavar="VIDEO",
        help="record the window as a video (.mp4, .mkv, .webm) until it is closed; needs Qt 6 and "
        "the extra [video]",
    )


def _run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file",
        metavar="FILE.qml",
        help="the interface; package://name/path for a file in a package",
    )
    _add_robot_url(parser)
    parser.add_argument("--name", default="", help="node name, instead of the one in the file")
    parser.add_argument(
        "--watch",
        action="store_true",
        help="reload the interface when a file in its folder is saved",
    )
    parser.add_argument(
        "--no-watch", dest="watch", action="store_false", help="do not reload (default)"
    )
    _add_import_paths(parser)
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")
    parser.add_argument(
        "--kiosk",
        action="store_true",
        help="fill the screen, ignore attempts to close the window (Alt-F4), and hide an idle "
        "pointer; Ctrl-C, SIGTERM and Qt.quit() end it",
    )
    _add_video(parser)
    _add_interface_options(parser, "the interface", "the window", after=2.0)
    parser.set_defaults(arguments=[], ros_arguments=[], looks_nearby=True)
    parser.epilog = (
        "Arguments after --ros-args are for ROS, as with ros2 run, e.g. -r chatter:=talk, "
        "-p speed:=1.5. Arguments after -- are passed to the interface, as "
        "Qt.application.arguments."
    )


def _plot(parser: argparse.ArgumentParser) -> None:
    _add_name(
        parser, "paths", "plot_paths", nargs="+", metavar="TOPIC:FIELD",
        help="topic and field, e.g. /odom:twist.twist.linear.x; [*] for each element of an array, "
        "in quotes",
    )  # fmt: skip
    parser.add_argument(
        "-w", "--window", type=_plot_window, default=30.0, metavar="SECONDS",
        help="time that is visible (default: %(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--history", type=seconds, default=600.0, metavar="SECONDS",
        help="time that is kept to scroll back; 0 for no limit (default: %(default)g)",
    )  # fmt: skip
    parser.add_argument(
        "--terminal", action="store_true",
        help="plot in the terminal, without Qt; where the output is not a terminal, print one plot "
        "after the window's time",
    )  # fmt: skip
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS",
        help="exit after this time, with --terminal",
    )  # fmt: skip
    parser.add_argument(
        "--color", choices=("auto", "always", "never"), default="auto",
        help="colours in the terminal (default: %(default)s)",
    )  # fmt: skip
    add_connection_options(parser, timeout=TIMEOUT_S)
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")
    _add_interface_options(parser, "the plot", "the window", after=5.0, definitions=False)


def _rviz(parser: argparse.ArgumentParser) -> None:
    config = parser.add_argument(
        "config",
        metavar="CONFIG.rviz",
        nargs="*",
        help="RViz's config; package://name/path for a file in a package (default: RViz's own "
        "default). Also remappings, as for RViz: scan:=/robot/scan",
    )
    complete(config, "*.rviz")
    _add_overlays(parser)
    parser.add_argument(
        "--url",
        default="",
        help="the ROS master of RViz and the interfaces, e.g. ros1://192.168.1.5:11311; default: "
        "ROS_MASTER_URI",
    )
    parser.add_argument("--name", default="", help="name of RViz's node (default: a unique one)")
    parser.add_argument(
        "--timeout",
        metavar="SECONDS",
        type=seconds,
        help="time to wait for the master (default: no limit)",
    )
    _add_3d_view(parser)
    parser.add_argument(
        "--bare",
        action="store_true",
        help="show only the 3D view, without RViz's menu, tool bar and panels (F10 shows them)",
    )
    parser.add_argument("--splash", action="store_true", help="show RViz's splash screen")
    parser.add_argument(
        "--disable-anti-aliasing",
        action="store_true",
        help="draw the 3D view without anti-aliasing: much faster without a graphics card",
    )
    _add_interface_options(parser, "interfaces in QML", "RViz's window", after=3.0)
    parser.set_defaults(arguments=[], ros_arguments=[], ros1=True)
    parser.epilog = (
        "The menu Overlays > View controller configures the camera: keyboard control, and the "
        "namespace of its topics and services (/rviz/hector_view_controller with --name rviz); "
        "the .rviz file stores it. "
        "Needs RViz 1 and the system's own Python: docs/rviz.md. Arguments after --ros-args, and "
        "remappings, are for ROS. Arguments after -- are passed to the interfaces, as "
        "Qt.application.arguments."
    )


def _view(parser: argparse.ArgumentParser) -> None:
    config = parser.add_argument(
        "config",
        metavar="CONFIG.rviz",
        nargs="?",
        default="",
        help="a config of RViz 1 or RViz 2; package://name/path for a file in a package (default: "
        "a grid and the robot's frames)",
    )
    complete(config, "*.rviz")
    _add_overlays(parser)
    _add_robot_url(parser)
    parser.add_argument("--name", default="", help="node name (default: rosglass_view)")
    _add_3d_view(parser)
    parser.add_argument(
        "--kiosk",
        action="store_true",
        help="fill the screen with the 3D view alone, without panels; ignore attempts to close "
        "the window (Alt-F4); Ctrl-C and SIGTERM end it",
    )
    _add_video(parser)
    _add_interface_options(parser, "the window", "the window", after=3.0)
    parser.set_defaults(arguments=[], ros_arguments=[], looks_nearby=True)
    parser.epilog = (
        "F10 hides the panels, F11 fills the screen. Displays that rosglass does not have are kept "
        "in the file. Needs Qt 6, and OpenGL, Vulkan, Metal or Direct3D: docs/scene.md. Arguments "
        "after --ros-args are for ROS."
    )


def _cockpit(parser: argparse.ArgumentParser) -> None:
    layout = parser.add_argument(
        "layout",
        metavar="FILE",
        nargs="?",
        default="",
        help="the layout (.qml; package://name/path for a file in a package; also one of Foxglove, "
        ".json, or RQml, .rqml) or the recording (.mcap, .bag, .db3) to open (default: a page with "
        "the robots found)",
    )
    complete(layout, "*.qml *.json *.rqml *.mcap *.bag *.db3")
    _add_robot_url(parser)
    parser.add_argument(
        "--panels",
        metavar="FOLDER",
        action="append",
        default=[],
        help="a folder with panels of your own: QML files, or plugins of RQml; may be repeated",
    )
    _add_import_paths(parser)
    parser.add_argument("--fullscreen", action="store_true", help="fill the screen")
    _add_interface_options(parser, "the window", "the window", after=3.0)
    parser.set_defaults(
        # It looks for robots itself, and shows what it finds.
        arguments=[],
        ros_arguments=[],
        looks_nearby=False,
        watch=False,
        kiosk=False,
        record=None,
    )
    parser.epilog = (
        "Ctrl+P lists all commands, F1 opens the help of a panel. `rosglass run LAYOUT.qml` shows "
        "a saved layout without the editor. Arguments after --ros-args are for ROS."
    )


def _qml_path(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--qmlls-ini",
        action="store_true",
        help="write .qmlls.ini in the current folder, to configure an editor's QML language "
        "server; other settings in the file are kept",
    )


def _demo(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--url",
        default=os.environ.get("ROSGLASS_URL") or _DEMO_URL,
        help="dds://, or the URL of a Zenoh router; starts one if none answers "
        f"(default: {_shown(os.environ.get('ROSGLASS_URL') or _DEMO_URL)})",
    )
    parser.add_argument(
        "--no-robot", action="store_true", help="use a robot that is already running"
    )
    parser.add_argument(
        "--seconds",
        type=float,
        metavar="N",
        help="exit after N seconds (default: when the window is closed; without a display: 20)",
    )
    parser.add_argument(
        "--screenshot",
        metavar="FILE.png",
        type=screenshot_file,
        help="save a screenshot before the end (default without a display: demo.png)",
    )
    parser.add_argument(
        "--headless",
        action="store_true",
        help="use a virtual screen and drive automatically, as on a machine without a display",
    )


def _shown(url: str) -> str:
    """Return a URL for a help text: without password, and percent signs twice."""
    return "that of ROSGLASS_URL" if "@" in url else url.replace("%", "%%")


def _robot_url() -> str:
    """Return the default of ``rosglass robot --url``, which its help shows."""
    # Spares help and completion a slow import.
    if os.environ.get("ROSGLASS_URL") or not os.environ.get("ROS_MASTER_URI"):
        return os.environ.get("ROSGLASS_URL") or _DEMO_URL
    from rosglass.cli.network import ros1_url  # noqa: PLC0415 - not for help and completion

    return ros1_url() or _DEMO_URL


def _robot(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--url",
        default=_robot_url(),
        help="URL of the graph (default: ROSGLASS_URL, or the ROS 1 master that "
        f"ROS_MASTER_URI names, or zenoh://127.0.0.1:7447; now: {_shown(_robot_url())})",
    )
    parser.add_argument("--name", default="robot", help="name of the node (default: %(default)s)")
    parser.add_argument(
        "--fps", type=float, default=30.0, help="camera images per second (default: 30)"
    )
    parser.add_argument("--no-raw", action="store_true", help="publish no raw camera images")
    parser.add_argument(
        "--no-compressed", action="store_true", help="publish no compressed camera images"
    )
    parser.add_argument(
        "--jpeg-quality",
        type=int,
        default=80,
        metavar="1-100",
        help="quality of compressed images (default: %(default)s)",
    )
    parser.add_argument(
        "--equipped",
        action="store_true",
        help="add a model and a point cloud for RViz, more cameras, modes, a mission and "
        "behaviours",
    )
    parser.add_argument(
        "--mode",
        default="supervised",
        metavar="MODE",
        help="initial mode with --equipped: autonomous, supervised or safe (default: %(default)s)",
    )
    parser.add_argument(
        "--leash",
        action="store_true",
        help="exit when standard input closes, so together with the program that started the robot",
    )
    parser.set_defaults(ros_arguments=[])


# -- the graph ---------------------------------------------------------------------------------


def _topic(parser: argparse.ArgumentParser) -> None:
    add = Subcommands(parser).add
    sub = add("list", "list topics", "list_topics")
    _add_list_options(sub)
    sub.add_argument("-c", "--count-topics", action="store_true", help="print the number of topics")
    sub.add_argument(
        "--hidden", "--include-hidden-topics", action="store_true", help="include hidden topics"
    )
    _add_common(sub)
    sub = add("info", "show the publishers and subscribers of a topic", "info")
    _add_name(sub, "topic", "topics")
    _add_common(sub)
    sub = add("echo", "print the messages of a topic", "echo")
    _add_topic_and_type(sub)
    sub.add_argument("-f", "--field", metavar="PATH", help="print one field, e.g. pose.position.x")
    _add_count(sub, "print")
    sub.add_argument(
        "--full", "--full-length", action="store_true", help="print long arrays in full"
    )
    sub.add_argument(
        "-l", "--truncate", "--truncate-length", type=positive_int, metavar="N",
        help="maximum array elements to print (default: 36; 10000 with --json; all with --csv)",
    )  # fmt: skip
    sub.add_argument("--csv", action="store_true", help="print comma-separated values")
    sub.add_argument("--raw", action="store_true", help="print the raw bytes in hexadecimal")
    sub.add_argument("--stamps", action="store_true", help="print the time of reception")
    _add_qos(sub, "best_available")
    _add_common(sub, timeout=None)
    for name, summary in (
        ("hz", "measure the rate of a topic's messages"),
        ("bw", "measure the bandwidth of a topic"),
        ("delay", "measure the delay of a topic's messages since their header.stamp"),
    ):
        sub = add(name, summary, "measure")
        _add_topic_and_type(sub)
        sub.add_argument(
            "-w",
            "--window",
            type=positive_int,
            default=_WINDOW,
            metavar="N",
            help="number of messages to average over (default: %(default)s)",
        )
        sub.add_argument(
            "-d", "--duration", type=seconds, metavar="SECONDS", help="exit after this time"
        )
        sub.add_argument(
            "-n",
            "--count",
            type=positive_int,
            metavar="N",
            help="exit after this number of messages",
        )
        _add_qos(sub, "best_available")
        _add_common(sub)
    sub = add("pub", "publish messages on a topic", "publish")
    _add_name(sub, "topic", "topics")
    _add_values(sub, "values as YAML: '{data: hello}'", "messages")
    sub.add_argument(
        "-r",
        "--rate",
        type=_rate,
        default=1.0,
        metavar="HZ",
        help="messages per second (default: %(default)g)",
    )
    _add_count(sub, "publish")
    sub.add_argument(
        "-w",
        "--wait",
        "--wait-matching-subscriptions",
        type=int,
        metavar="N",
        help="wait for this number of subscriptions first (default: 1 with --once, else 0)",
    )
    sub.add_argument(
        "--keep-alive", type=seconds, default=0.5, metavar="SECONDS",
        help="time to wait for delivery after the last message (default: %(default)g)",
    )  # fmt: skip
    _add_qos(sub, "default")
    _add_common(sub)


def _add_topic_and_type(parser: argparse.ArgumentParser) -> None:
    _add_name(parser, "topic", "topics")
    _add_name(
        parser, "type", "messages", nargs="?", help="message type (default: the published one)"
    )


def _add_count(parser: argparse.ArgumentParser, verb: str) -> None:
    parser.add_argument(
        "-n",
        "-t",
        "--count",
        "--times",
        type=positive_int,
        help=f"{verb} this number of messages and exit",
    )
    parser.add_argument(
        "-1",
        "--once",
        dest="count",
        action="store_const",
        const=1,
        help=f"{verb} one message and exit",
    )


def _add_qos(parser: argparse.ArgumentParser, default: str) -> None:
    group = parser.add_argument_group("quality of service")
    group.add_argument(
        "--qos",
        "--qos-profile",
        default=default,
        metavar="PROFILE",
        help="default, sensor_data, latched, best_available, ... (default: %(default)s)",
    )
    group.add_argument("--depth", "--qos-depth", type=positive_int, help="history depth")
    for policy, words in (
        ("reliability", ("reliable", "best_effort")),
        ("durability", ("volatile", "transient_local")),
        ("history", ("keep_last", "keep_all")),
    ):
        group.add_argument(f"--qos-{policy}", choices=words, help="override the profile")


def _service(parser: argparse.ArgumentParser) -> None:
    add = Subcommands(parser).add
    sub = add("list", "list services", "list_services")
    _add_list_options(sub)
    sub.add_argument(
        "--hidden", "--include-hidden-services", action="store_true",
        help="include the services of actions",
    )  # fmt: skip
    _add_common(sub)
    sub = add("info", "show the servers and clients of a service", "info")
    _add_name(sub, "service", "services")
    _add_common(sub)
    sub = add("call", "call a service and print its response", "call")
    _add_name(sub, "service", "services")
    _add_values(sub, "values as YAML: '{a: 1, b: 2}'", "service_types")
    _add_common(sub)


def _lifecycle(parser: argparse.ArgumentParser) -> None:
    parser.epilog = "Only ROS 2 has lifecycle nodes."
    add = Subcommands(parser).add
    sub = add("nodes", "list lifecycle nodes", "list_nodes")
    sub.add_argument(
        "-a", "--all", "--include-hidden-nodes", action="store_true", help="include hidden nodes"
    )
    sub.add_argument(
        "-c", "--count", "--count-nodes", action="store_true", help="print the number of nodes"
    )
    _add_common(sub)
    sub = add("get", "print the state of a lifecycle node, or of all", "get")
    _add_name(sub, "node", "lifecycle_nodes", nargs="?", default="")
    _add_common(sub)
    sub = add("list", "list the transitions from a node's current state", "list_transitions")
    _add_name(sub, "node", "lifecycle_nodes")
    sub.add_argument("-a", "--all", action="store_true", help="list the transitions of all states")
    _add_common(sub)
    sub = add("set", "request a transition, and wait until it is done", "set_state")
    _add_name(sub, "node", "lifecycle_nodes")
    sub.add_argument(
        "transition", help="name or number, e.g. configure, activate, deactivate, shutdown"
    )
    _add_common(sub, timeout=30.0)


def _action(parser: argparse.ArgumentParser) -> None:
    add = Subcommands(parser).add
    sub = add("list", "list actions", "list_actions")
    _add_list_options(sub)
    _add_common(sub)
    sub = add("info", "show the servers and clients of an action", "info")
    _add_name(sub, "action", "actions")
    _add_common(sub)
    summary = "send a goal and wait for its result; Ctrl-C cancels it"
    sub = add("send", summary, "send", aliases=("send_goal",))
    _add_name(sub, "action", "actions")
    _add_values(sub, "goal as YAML: '{order: 5}'", "action_types")
    sub.add_argument("-f", "--feedback", action="store_true", help="print feedback")
    _add_common(sub)


def _param(parser: argparse.ArgumentParser) -> None:
    parser.epilog = (
        "ROS 1 keeps all parameters on one server: NODE may be any namespace, and a name such as "
        "/robot/speed stands for NODE and PARAMETER."
    )

    def add(name: str, summary: str, **node: Any) -> argparse.ArgumentParser:
        sub = commands.add(name, summary, "run")
        _add_name(sub, "node", "nodes", **node)
        return sub

    commands = Subcommands(parser)
    sub = add(
        "list",
        "list the parameters of a node, or of all nodes",
        nargs="?",
        help="name of the node (default: all nodes)",
    )
    _add_common(sub)
    for name, summary in (
        ("get", "print the value of a parameter"),
        ("describe", "show the descriptor of a parameter"),
        ("set", "set a parameter"),
        ("delete", "delete a parameter that was set without being declared"),
    ):
        sub = add(name, summary)
        sub.add_argument(
            "parameter",
            nargs="?",
            help="name of the parameter, e.g. exposure; in ROS 1 the node argument may contain it",
        )
        if name == "set":
            sub.add_argument("value", nargs="?", help="value as YAML: 1.5, true, hello, [1, 2]")
        _add_common(sub)
    summary = "print all parameters of a node as a parameter file"
    sub = add("dump", summary, nargs="?", help="name of the node; optional in ROS 1: all")
    sub.add_argument("-o", "--output", metavar="FILE", help="write to a file")
    _add_common(sub)
    summary = "set the parameters of a node from a file"
    sub = add("load", summary, help="name of the node; in ROS 1 optional, or after the file")
    sub.add_argument("file", metavar="FILE.yaml", nargs="?", help="a parameter file")
    _add_common(sub)


def _node(parser: argparse.ArgumentParser) -> None:
    add = Subcommands(parser).add
    _add_common(add("list", "list nodes", "list_nodes"))
    sub = add("info", "show the topics, services and actions of a node", "info")
    _add_name(sub, "node", "nodes")
    sub.add_argument(
        "--hidden",
        "--include-hidden",
        action="store_true",
        help="include the topics and services of actions",
    )
    _add_common(sub)
    sub = add("ping", "ping a node repeatedly (ROS 1)", "ping")
    _add_name(sub, "node", "nodes")
    sub.add_argument(
        "-n",
        "-c",
        "--count",
        type=positive_int,
        metavar="N",
        help="exit after this number of pings",
    )
    _add_common(sub)
    sub = add("kill", "shut nodes down (ROS 1)", "kill")
    _add_name(sub, "node", "nodes", nargs="+")
    _add_common(sub)
    sub = add("cleanup", "unregister nodes that cannot be reached (ROS 1)", "cleanup")
    sub.add_argument("-y", "--yes", action="store_true", help="do not ask for confirmation")
    _add_common(sub)


def _interface(parser: argparse.ArgumentParser) -> None:
    add = Subcommands(parser).add
    sub = add("show", "show the definition of a type, fetched from the robot if necessary", "show")
    _add_name(sub, "type", "interfaces", help="e.g. geometry_msgs/msg/Twist")
    sub.add_argument("--no-comments", action="store_true", help="omit comments")
    sub.add_argument(
        "--template", action="store_true", help="print a message with all defaults, as YAML"
    )
    sub.add_argument(
        "--ros1", action="store_true", help="show the ROS 1 type; implied by --url ros1://..."
    )
    _add_common(sub, timeout=5.0)
    sub = add("list", "list the types available on this machine", "list_types")
    sub.add_argument("text", nargs="?", default="", help="list only names that contain this text")
    sub.add_argument(
        "--kind", choices=("msg", "srv", "action"), help="list only types of this kind"
    )
    sub.add_argument("--ros1", action="store_true", help="list ROS 1 types")
    add_definitions_option(sub)
    add_output_options(sub)
    sub.set_defaults(url="")


# -- messages between graphs and files ---------------------------------------------------------


def _record(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "topics",
        nargs="*",
        metavar="TOPIC",
        help="topics to record (default: all, including new ones)",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE.mcap",
        help="file to write; default: recording_<date>_<time>.mcap; from ROS 1 also FILE.bag",
    )
    parser.add_argument("-a", "--all", action="store_true", help="record all topics (default)")
    parser.add_argument(
        "-e", "--regex", default="", metavar="REGEX", help="also record matching topics"
    )
    _add_exclude(parser, "topics")
    parser.add_argument(
        "--hidden",
        "--include-hidden-topics",
        action="store_true",
        help="include hidden topics, e.g. those of actions",
    )
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS", help="exit after this time"
    )
    parser.add_argument(
        "--compression",
        choices=("zstd", "lz4", "bz2", "none"),
        default="",
        help="zstd (default), lz4 or none; for FILE.bag none (default), lz4 or bz2",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    add_connection_options(parser)
    parser.epilog = "Ctrl-C ends the recording. Play it with rosglass play FILE.mcap."


def _play(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", nargs="?", help="MCAP file, ROS 2 bag or ROS 1 bag")
    parser.add_argument(
        "--list", action="store_true", help="list the contents of the recording and exit"
    )
    parser.add_argument("--json", action="store_true", help="with --list: print JSON")
    parser.add_argument(
        "-r",
        "--rate",
        type=float,
        default=1.0,
        help="speed, 2 is twice as fast (default: %(default)g)",
    )
    parser.add_argument("-l", "--loop", action="store_true", help="start over at the end")
    parser.add_argument(
        "--clock",
        nargs="?",
        type=float,
        const=40.0,
        default=0.0,
        metavar="HZ",
        help="publish /clock, for nodes with use_sim_time (default rate: 40 Hz)",
    )
    parser.add_argument(
        "-t", "--topics", nargs="+", default=[], metavar="TOPIC", help="play only these topics"
    )
    _add_exclude(parser, "topics")
    parser.add_argument(
        "-m",
        "--remap",
        nargs="+",
        default=[],
        metavar="OLD:=NEW",
        help="publish a topic under another name",
    )
    parser.add_argument(
        "--start",
        "--start-offset",
        type=seconds,
        default=0.0,
        metavar="SECONDS",
        help="start this long after the beginning of the recording",
    )
    parser.add_argument(
        "--duration", "--playback-duration", type=seconds, metavar="SECONDS",
        help="play only this long",
    )  # fmt: skip
    parser.add_argument(
        "-d",
        "--delay",
        type=seconds,
        default=1.0,
        metavar="SECONDS",
        help="time for subscriptions to connect before the first message (default: %(default)g)",
    )
    parser.add_argument(
        "-p", "--paused", "--start-paused", action="store_true", help="start paused"
    )
    parser.add_argument(
        "--no-keys", "--disable-keyboard-controls", action="store_true", help="ignore keys"
    )
    add_connection_options(parser)
    parser.epilog = f"Keys during playback: {PLAY_KEYS}."


def _bridge(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", metavar="URL", help="the first graph, e.g. ros1://robot:11311")
    parser.add_argument(
        "second", metavar="URL", help="the second graph, e.g. zenoh://127.0.0.1:7447"
    )
    parser.add_argument(
        "-t",
        "--topic",
        action="append",
        default=[],
        metavar="NAME",
        help="relay a topic in both directions; NAME:=OTHER renames it in the second graph, "
        "'NAME->' relays it only from the first to the second, 'NAME<-' only from the second to "
        "the first; * matches any characters; may be repeated",
    )
    parser.add_argument(
        "-s",
        "--service",
        action="append",
        default=[],
        metavar="NAME",
        help="the same for a service; 'NAME->' is a service offered in the first graph",
    )
    parser.add_argument(
        "--action",
        action="append",
        default=[],
        metavar="NAME",
        help="the same for an action: goals, feedback, results and cancel requests",
    )
    parser.add_argument(
        "-a",
        "--all",
        action="store_true",
        help="relay all topics, services and actions, except hidden and built-in ones",
    )
    _add_exclude(parser, "names")
    parser.add_argument(
        "--one-way",
        action="store_true",
        help="relay only from the first graph to the second, unless an arrow says otherwise",
    )
    parser.add_argument(
        "--type",
        action="append",
        default=[],
        type=pair("/topic:=package/Type"),
        metavar="NAME:=TYPE",
        help="the type of a topic that has no publisher yet, to relay its first message as well",
    )
    parser.add_argument(
        "--qos",
        default="",
        metavar="PRESET",
        help="quality of service on both sides, e.g. sensor_data (default: matching)",
    )
    parser.add_argument(
        "--keep",
        action="store_true",
        help="subscribe even while the other graph has no subscriber",
    )
    parser.add_argument(
        "--service-timeout",
        type=seconds,
        default=10.0,
        metavar="SECONDS",
        help="time that servers have to respond (default: %(default)g)",
    )
    parser.add_argument(
        "--list",
        "--dry-run",
        action="store_true",
        help="list what would be relayed, and how, and exit",
    )
    parser.add_argument(
        "--statistics",
        type=seconds,
        default=5.0,
        metavar="SECONDS",
        help="period of the statistics lines, 0 for none (default: %(default)g)",
    )
    parser.add_argument(
        "-d", "--duration", type=seconds, metavar="SECONDS", help="exit after this time"
    )
    parser.add_argument(
        "--node-name", default="", metavar="NAME", help="name of both nodes (default: a unique one)"
    )
    parser.add_argument(
        "--timeout",
        type=seconds,
        default=TIMEOUT_S,
        metavar="SECONDS",
        help="time to wait for each graph to answer (default: %(default)g)",
    )
    add_definitions_option(parser)
    add_output_options(parser)
    parser.epilog = (
        "Ctrl-C ends the bridge. docs/bridge.md in the source lists how types are mapped, and what "
        "is lost."
    )


# -- this machine ------------------------------------------------------------------------------


def _doctor(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--scan", action="store_true", help="over DDS, look for robots in the domains 0 to 10"
    )
    add_output_options(parser)
    add_connection_options(parser, timeout=5.0)
    parser.set_defaults(looks_nearby=False)  # it reports what it finds


def _router(parser: argparse.ArgumentParser) -> None:
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--listen",
        metavar="tcp/HOST:PORT",
        help="endpoint to listen on, or tls/HOST:PORT; port 0 selects a free one (default: from "
        "the configuration, or tcp/127.0.0.1:7447, this machine only)",
    )
    where.add_argument(
        "--open",
        action="store_const",
        const="tcp/[::]:7447",
        dest="listen",
        help="listen on all interfaces, as ROS 2's own router does: tcp/[::]:7447",
    )
    parser.add_argument(
        "--config",
        metavar="FILE",
        help="Zenoh configuration (JSON5), as for rmw_zenohd: users, TLS, access control "
        "(default: ZENOH_ROUTER_CONFIG_URI)",
    )
    parser.epilog = "docs/security.md in the source has a configuration with users and TLS."


#: Template of ``rosglass new`` -> its description.
TEMPLATES = {
    "cockpit": "camera, map, driving, stop, plot and states of one robot",
    "teleop": "camera, stick, keys and stop",
    "fleet": "several robots, one of which is driven",
    "kiosk": "states on a screen that visitors touch",
}


def _new(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.qml", help="the new file; an existing one is kept")
    parser.add_argument(
        "--template",
        choices=tuple(TEMPLATES),
        default="cockpit",
        help="; ".join(f"{name}: {what}" for name, what in TEMPLATES.items())
        + " (default: %(default)s)",
    )


def _examples(parser: argparse.ArgumentParser) -> None:
    _add_name(
        parser,
        "names",
        "examples",
        nargs="*",
        metavar="NAME",
        help="an example to copy to this folder, with what it needs; without, all are listed",
    )
    parser.add_argument(
        "--all",
        metavar="FOLDER",
        help="copy all examples, and the demo's cockpit, into a new folder",
    )


def _completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=("bash", "zsh", "fish", "tcsh"), help="the shell")
    parser.epilog = (
        'For bash, put this into ~/.bashrc: eval "$(rosglass completion bash)". '
        "Topics, services, actions and nodes come from the robot at ROSGLASS_URL."
    )


#: Command -> (what declares its options, its help in one line). Its module is the one of its name,
#: with ``run(args) -> int`` or a function for each subcommand.
COMMANDS = {
    "run": (_run, "open an interface written in QML"),
    "cockpit": (_cockpit, "arrange a robot's panels on a screen, without a line of code"),
    "rviz": (_rviz, "open RViz with interfaces over its 3D view"),
    "plot": (_plot, "plot numbers of topics, in a window or the terminal"),
    "view": (_view, "show the robot in a 3D view like RViz's, without RViz"),
    "qml-path": (_qml_path, "print the folders of the QML modules, for editors"),
    "demo": (_demo, "open the demo cockpit on a simulated robot"),
    "robot": (_robot, "run the simulated robot"),
    "topic": (_topic, "inspect topics, receive and publish messages"),
    "service": (_service, "inspect and call services"),
    "action": (_action, "inspect actions and send goals"),
    "param": (_param, "read and set the parameters of nodes"),
    "node": (_node, "inspect nodes"),
    "lifecycle": (_lifecycle, "inspect lifecycle nodes and change their states"),
    "interface": (_interface, "show message, service and action types"),
    "record": (_record, "record topics to an MCAP file or a ROS 1 bag"),
    "play": (_play, "play a recording: MCAP, ROS 2 bag or ROS 1 bag"),
    "bridge": (_bridge, "relay topics, services and actions between two graphs"),
    "doctor": (_doctor, "find what blocks the connection to the robot"),
    "router": (_router, "run a Zenoh router for ROS 2 (rmw_zenoh)"),
    "new": (_new, "write an interface to start from"),
    "examples": (_examples, "list the examples, or copy one to start from"),
    "completion": (_completion, "print the shell code for Tab completion"),
}
