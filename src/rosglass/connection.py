"""Connecting to a robot: which world a URL or the environment names."""

from __future__ import annotations

import itertools
import os
from importlib.util import find_spec
from typing import TYPE_CHECKING

from rosglass.comm.handle import check_flag
from rosglass.errors import ArgumentError, UnsupportedError
from rosglass.interfaces import Library

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rosglass.comm import Node
    from rosglass.ros2 import Middleware

__all__ = ["connect", "default_url", "explain_missing"]

_EXAMPLE = "zenoh://127.0.0.1:7447"
_EXAMPLES = "zenoh://127.0.0.1:7447, dds://?domain=0 or ros1://robot:11311"
_KNOWN = (
    "dds:// (ROS 2 with any DDS), zenoh:// (ROS 2 with rmw_zenoh), ros1:// (ROS 1, its master), "
    "replay:FILE (a recording), local://NAME (a graph inside this process)"
)
#: Values of RMW_IMPLEMENTATION and what they mean; dynamic and vendor variants speak plain DDS.
_MIDDLEWARES = {
    "rmw_zenoh_cpp": "zenoh://",
    "rmw_cyclonedds_cpp": "dds://",
    "rmw_fastrtps_cpp": "dds://",
    "rmw_fastrtps_dynamic_cpp": "dds://",
    "rmw_connextdds": "dds://",
    "rmw_gurumdds_cpp": "dds://",
}
#: Packages that are not always installed, and the extra that installs them.
_EXTRA_OF = {
    "PySide6": "qml",
    "zenoh": "zenoh",
    "xxhash": "zenoh",
    "cyclonedds": "dds",
    "cv2": "images",
    "av": "video",
    "mcap": "bags",
    "rosbags": "bags",
    "argcomplete": "completion",
}
_anonymous = itertools.count(1)


def connect(
    url: str | None = None,
    name: str | None = None,
    namespace: str | None = None,
    *,
    library: Library | None = None,
    arguments: Sequence[str] = (),
    own_services: bool = True,
) -> Node:
    """Join a robot's graph and return the node that stands for this program in it.

    Returns at once: when nobody answers, the node keeps trying, says so in
    :meth:`~rosglass.comm.Node.status`, and catches up when someone does.

    Args:
        url: ``dds://`` joins a DDS domain, where ROS 2 nodes find each other by themselves.
            Options follow as in ``dds://?domain=5&interface=eth0``: ``domain`` (default:
            ROS_DOMAIN_ID, or 0), ``range`` (where to look for others: ``subnet``, ``localhost``,
            ``off``, ``system_default``; default: ROS_AUTOMATIC_DISCOVERY_RANGE, or ``subnet``),
            ``peers`` (machines to ask besides, as in ``peers=192.168.1.5,robot``; short:
            ``dds://192.168.1.5``; ROS_STATIC_PEERS adds some), ``interface`` (network
            interfaces, by name or address), ``distro=humble`` (announce nodes as Humble does;
            default: as the others do). ROS_LOCALHOST_ONLY and CYCLONEDDS_URI are respected.

            ``zenoh://host:port`` of a Zenoh router (rmw_zenoh), port 7447 when left out. Options
            follow as in ``zenoh://robot:7447?domain=5&mode=client``: ``domain`` (default:
            ROS_DOMAIN_ID, or 0), ``mode`` (``peer`` links directly with other nodes, ``client``
            only with the router), ``distro=humble`` (announce types as Humble does),
            ``shm=true`` (shared memory between programs of one machine that both allow it).
            ``zenoh://`` alone means the router that ZENOH_SESSION_CONFIG_URI names, or one on this
            machine.

            ``ros1://host:port`` of a ROS 1 master, port 11311 when left out. Options follow as in
            ``ros1://robot?ip=192.168.1.5``: ``ip`` (host or address under which others reach this
            machine; default: ROS_HOSTNAME, ROS_IP, or the address from which the master is
            reached), ``tcpros_port`` and ``slave_port`` (to listen on, for firewalls; default:
            any), ``anonymous=true`` (append to the node's name what makes it the only one: a
            second node of a name ends the first one). ``ros1://`` alone means the master that
            ROS_MASTER_URI names, or one on this machine.

            ``replay:drive.mcap`` plays a recording (MCAP file, ROS 2 bag, ROS 1 bag) to the node's
            subscriptions, without a robot. Options follow as in ``replay:/data/drive.bag?rate=2``:
            ``rate``, ``loop=true`` (else it pauses at the end), ``paused=true``. In the path,
            ``%3F``, ``%23`` and ``%25`` stand for ``?``, ``#`` and ``%``. See
            :class:`rosglass.bags.ReplayNode`.

            ``local://NAME`` is a graph inside this process, without a network, for tests and for
            interfaces without a robot: nodes that give the same name see each other, and no
            others. Topics, services, actions and parameters are those of ROS 2.

            None asks the environment: ROSGLASS_URL, then RMW_IMPLEMENTATION,
            ZENOH_SESSION_CONFIG_URI, ROS_DISTRO, ROS_DOMAIN_ID and ROS_MASTER_URI.
        name: Base name of the node; None for one that nobody else has, ``rosglass_<process id>``;
            in ROS 1 with host and time, too.
        namespace: Absolute namespace of the node; None for ROS_NAMESPACE in ROS 1, which
            counts for ``/``, too, else ``/``.
        library: Where message definitions come from; None for the shared library.
        arguments: A command line such as ``sys.argv``: what stands in it between ``--ros-args``
            and ``--`` can rename the node, its topics and services (``-r chatter:=talk``,
            ``-r __node:=left``, ``-r __ns:=/arm``), set parameters (``-p speed:=1.5``,
            ``--params-file robot.yaml``) and log levels (``--log-level debug``).

            In ROS 1: ``chatter:=talk`` for topics, services and parameters, ``_speed:=1.5`` for
            private parameters, ``__name:=left``, ``__ns:=/arm``, ``__ip:=192.168.1.5``,
            ``__hostname:=panel`` and ``__master:=http://robot:11311``, anywhere; between
            ``--ros-args`` and ``--`` also ``-r chatter:=talk`` and ``-p speed:=1.5``.
        own_services: Whether other nodes find what every node offers: in ROS 2 its parameters, its
            log, descriptions of its types; in ROS 1 its log and services for log levels. They
            appear shortly after connecting.

    Raises:
        ArgumentError: A part of the URL, an environment variable or an option is not valid.
        RosArgumentError: One of `arguments` is not valid; the message says which, and what to
            write instead.
        UnsupportedError: The URL's scheme is unknown, or there is neither URL nor environment.
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: This machine cannot open a session at all.
        BagError: The recording cannot be read.
    """
    if url is None:
        url = default_url(os.environ)
    if not isinstance(url, str):
        raise ArgumentError("url", url, f"a text such as {_EXAMPLES}")
    scheme, separator, rest = url.partition("://")
    scheme = scheme.lower()
    if separator:
        url = f"{scheme}://{rest}"
    if library is not None and not isinstance(library, Library):
        raise ArgumentError("library", library, "a rosglass.Library, or None for the shared one")
    check_flag(own_services, "own_services", "connect()")
    if url.lower().startswith("replay:"):
        from rosglass.bags.replay_node import connect_replay  # noqa: PLC0415

        return connect_replay(url, *_named(name, namespace, arguments))
    if scheme not in ("dds", "zenoh", "ros1", "local") or not separator:
        reason = f"unknown scheme {scheme!r}" if separator else "no scheme"
        raise UnsupportedError(
            f"cannot connect to {url!r}: {reason}; known: {_KNOWN}, e.g. {_EXAMPLES}"
        )
    if scheme == "ros1":
        from rosglass.ros1.node import Ros1Node  # noqa: PLC0415
        from rosglass.ros1.options import Ros1Options  # noqa: PLC0415
        from rosglass.ros1.remapping_arguments import Arguments as Ros1Arguments  # noqa: PLC0415

        options = Ros1Options.parse(url, arguments=Ros1Arguments.parse(arguments))
        return Ros1Node(
            options,
            url,
            options.node_name(name),
            options.namespace(namespace),
            library,
            options.arguments.parameters,
            own_services=own_services,
        )
    from rosglass.ros2.ros_arguments import Arguments  # noqa: PLC0415

    told = Arguments.parse(arguments)
    name, namespace = _named(name, namespace, arguments)
    middleware = {"dds": _dds, "zenoh": _zenoh, "local": _local}[scheme](url)
    from rosglass.ros2.node import Ros2Node  # noqa: PLC0415

    return Ros2Node(middleware, url, name, namespace, library, told, own_services=own_services)


def _named(name: str | None, namespace: str | None, arguments: Sequence[str]) -> tuple[str, str]:
    """Return what a node is called, by ROS 2's rules."""
    from rosglass.ros2.ros_arguments import Arguments  # noqa: PLC0415

    if name is None:
        number = next(_anonymous)
        name = f"rosglass_{os.getpid()}" + (f"_{number}" if number > 1 else "")
    told = Arguments.parse(arguments)
    name = told.node_name(name)
    return name, told.namespace(name, "/" if namespace is None else namespace)


def default_url(env: Mapping[str, str]) -> str:
    """Return the URL that the environment `env` asks for; raises UnsupportedError when it doesn't.

    ROSGLASS_URL wins; otherwise RMW_IMPLEMENTATION names the middleware, as for ROS 2's own
    programs, and a Zenoh session configuration implies Zenoh. Where ROS 2 is set up, or a domain is
    chosen, without any of these, it means DDS, ROS 2's default. ROS_MASTER_URI alone means ROS 1.
    """
    choice = (
        "pass a URL to connect() (--url on the command line), or set ROSGLASS_URL, "
        f"e.g. to {_EXAMPLES}"
    )
    if env.get("ROSGLASS_URL"):
        return env["ROSGLASS_URL"]
    implementation = env.get("RMW_IMPLEMENTATION", "")
    if implementation:
        if implementation not in _MIDDLEWARES:
            known = ", ".join(_MIDDLEWARES)
            raise UnsupportedError(
                f"RMW_IMPLEMENTATION={implementation} is not known (known: {known}): {choice}"
            )
        return _MIDDLEWARES[implementation]
    if env.get("ZENOH_SESSION_CONFIG_URI"):
        return "zenoh://"
    ros2 = env.get("ROS_DISTRO") and env.get("ROS_VERSION") != "1"
    if ros2 or env.get("ROS_DOMAIN_ID") or env.get("CYCLONEDDS_URI"):
        return "dds://"
    if env.get("ROS_MASTER_URI"):
        return "ros1://"
    raise UnsupportedError(f"no robot was named: {choice}")


def _zenoh(url: str) -> Middleware:
    # Zenoh's package is an extra, and takes a while to import.
    if find_spec("zenoh") is None or find_spec("xxhash") is None:
        raise UnsupportedError(
            f"cannot connect to {url!r}: Zenoh is not installed; "
            'install it with: pip install "rosglass[zenoh]"; '
            "without it, there are dds:// (other ROS 2 robots) and ros1://host:11311 (ROS 1)"
        )
    from rosglass.wires.zenoh.options import ZenohOptions  # noqa: PLC0415

    options = ZenohOptions.parse(url, os.environ)
    from rosglass.wires.zenoh.middleware import ZenohMiddleware  # noqa: PLC0415

    return ZenohMiddleware(options)


def _dds(url: str) -> Middleware:
    if find_spec("cyclonedds") is None:
        raise UnsupportedError(
            f"cannot connect to {url!r}: Cyclone DDS is not installed; "
            'install it with: pip install "rosglass[dds]"; '
            "without it, there are zenoh:// (ROS 2 with rmw_zenoh) and ros1://host:11311 (ROS 1)"
        )
    from rosglass.wires.dds.domain import DdsOptions  # noqa: PLC0415

    options = DdsOptions.parse(url, os.environ)
    from rosglass.wires.dds.middleware import DdsMiddleware  # noqa: PLC0415

    return DdsMiddleware(options)


def _local(url: str) -> Middleware:
    from rosglass.wires.local import LocalMiddleware  # noqa: PLC0415 - few need it

    return LocalMiddleware(url)


def explain_missing(error: ModuleNotFoundError) -> str:
    """Return which package is missing, and how to install it; empty where no extra installs it."""
    extra = _EXTRA_OF.get((error.name or "").partition(".")[0])
    if extra is None:
        return ""
    return f'{error.name} is not installed; install it with: pip install "rosglass[{extra}]"'
