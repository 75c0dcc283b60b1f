"""Connecting to a ROS graph, given by a URL or the environment."""

from __future__ import annotations

import itertools
import logging
import os
from importlib.util import find_spec
from typing import TYPE_CHECKING

from rosglass.comm.handle import check_flag
from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, UnsupportedError
from rosglass.extras import install_command
from rosglass.interfaces import Library
from rosglass.ros2.ros_arguments import Arguments
from rosglass.wires.zenoh.options import ZenohOptions, shown_url

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rosglass.comm import Node
    from rosglass.ros2 import Middleware

__all__ = ["connect", "default_url"]

_log = logging.getLogger("rosglass.ros2")
_SCHEMES = ("dds", "zenoh", "ros1", "local")
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
    """Connect to a ROS graph, and return this program's node in it.

    Returns at once: without an answer, the node retries, as its
    :meth:`~rosglass.comm.Node.status` says, and completes everything once connected.

    Args:
        url: ``dds://`` joins a DDS domain, where ROS 2 nodes discover each other.
            Options follow as in ``dds://?domain=5&interface=eth0``: ``domain`` (default:
            ROS_DOMAIN_ID, or 0), ``range`` (where to discover nodes: ``subnet``, ``localhost``,
            ``off``, ``system_default``; default: ROS_AUTOMATIC_DISCOVERY_RANGE, or ``subnet``),
            ``peers`` (further machines, as in ``peers=192.168.1.5,robot``; short:
            ``dds://192.168.1.5``; ROS_STATIC_PEERS adds some), ``interface`` (network
            interfaces, by name or address), ``distro=humble`` (announce nodes as in Humble;
            default: as the domain's other nodes). ROS_LOCALHOST_ONLY and CYCLONEDDS_URI apply.

            ``zenoh://host:port`` of a Zenoh router (rmw_zenoh), by default port 7447. Options
            follow as in ``zenoh://robot:7447?domain=5&mode=client``: ``domain`` (default:
            ROS_DOMAIN_ID, or 0), ``mode`` (``peer`` links directly with other nodes, ``client``
            only with the router), ``distro=humble`` (announce types as in Humble),
            ``shm=true`` (shared memory between programs of one machine that both allow it).
            ``zenoh://NAME:PASSWORD@host`` for routers with users; ``tls=true``, ``ca=FILE``,
            ``cert=FILE`` and ``key=FILE`` for those with TLS.
            ``zenoh://`` alone means the router that ZENOH_SESSION_CONFIG_URI names, or one on this
            machine.

            ``ros1://host:port`` of a ROS 1 master, by default port 11311. Options follow as in
            ``ros1://robot?ip=192.168.1.5``: ``ip`` (host or address at which other nodes reach this
            machine; default: ROS_HOSTNAME, ROS_IP, or the address from which the master is
            reached), ``tcpros_port`` and ``slave_port`` (to listen on, for firewalls; default:
            any), ``anonymous=true`` (make the node's name unique: a second node of the same
            name ends the first one). ``ros1://`` alone means the master that
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
        name: Base name of the node; None for a unique one, ``rosglass_<process id>``, in ROS 1 also
            with host and time.
        namespace: Absolute namespace of the node; None for ROS_NAMESPACE in ROS 1, which
            also applies to ``/``, or else ``/``.
        library: Source of message definitions; None for the shared library.
        arguments: A command line such as ``sys.argv``: its part between ``--ros-args`` and ``--``
            can rename the node, its topics and services (``-r chatter:=talk``,
            ``-r __node:=left``, ``-r __ns:=/arm``), set parameters (``-p speed:=1.5``,
            ``--params-file robot.yaml``) and log levels (``--log-level debug``).

            In ROS 1: ``chatter:=talk`` for topics, services and parameters, ``_speed:=1.5`` for
            private parameters, ``__name:=left``, ``__ns:=/arm``, ``__ip:=192.168.1.5``,
            ``__hostname:=panel`` and ``__master:=http://robot:11311``, anywhere; between
            ``--ros-args`` and ``--`` also ``-r chatter:=talk`` and ``-p speed:=1.5``.
        own_services: Whether to offer the standard services and topics of a node: in ROS 2
            parameters, log and type descriptions; in ROS 1 log and logger levels. They appear
            shortly after connecting.

    Raises:
        ArgumentError: A part of the URL, an environment variable or an option is not valid.
        RosArgumentError: One of `arguments` is not valid; the message says what to write instead.
        UnsupportedError: The URL's scheme is unknown, or neither URL nor environment is given.
        InvalidNameError: The name or namespace breaks ROS's rules.
        ConnectionLostError: This machine cannot open a session.
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
        from rosglass.bags.replay_node import connect_replay  # noqa: PLC0415 - few play any

        return connect_replay(url, *_resolve_name(name, namespace, arguments))
    if scheme not in _SCHEMES or not separator:
        reason = f"unknown scheme {scheme!r}" if separator else "no scheme"
        hint = similar(scheme, _SCHEMES) if separator else ""
        if scheme == "http":  # as in ROS_MASTER_URI
            hint = f"; did you mean ros1://{rest}?"
        known = f"{hint} Known" if hint else "; known"
        raise UnsupportedError(
            f"cannot connect to {shown_url(url)!r}: {reason}{known}: {_KNOWN}, e.g. {_EXAMPLES}"
        )
    if scheme == "ros1":
        from rosglass.ros1.node import connect_ros1  # noqa: PLC0415 - a program uses one ROS

        return connect_ros1(url, name, namespace, library, arguments, own_services)
    parsed = Arguments.parse(arguments)
    name, namespace = _resolve_name(name, namespace, arguments)
    middleware = {"dds": _dds, "zenoh": _zenoh, "local": _local}[scheme](url)
    from rosglass.ros2.node import Ros2Node  # noqa: PLC0415 - a program uses one ROS

    shown = shown_url(url)
    return Ros2Node(middleware, shown, name, namespace, library, parsed, own_services=own_services)


def _resolve_name(
    name: str | None, namespace: str | None, arguments: Sequence[str]
) -> tuple[str, str]:
    """Return the name and namespace of a node by ROS 2's rules."""
    if name is None:
        number = next(_anonymous)
        name = f"rosglass_{os.getpid()}" + (f"_{number}" if number > 1 else "")
    parsed = Arguments.parse(arguments)
    name = parsed.node_name(name)
    return name, parsed.namespace(name, "/" if namespace is None else namespace)


def default_url(env: Mapping[str, str]) -> str:
    """Return the URL for the environment `env`; raises UnsupportedError if it specifies none.

    ROSGLASS_URL has priority; then RMW_IMPLEMENTATION names the middleware, as for ROS 2's own
    programs; a Zenoh session configuration implies Zenoh. Without these, a ROS 2 environment or a
    domain means DDS, ROS 2's default. ROS_MASTER_URI alone means ROS 1.
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
    if find_spec("zenoh") is None or find_spec("xxhash") is None:
        raise UnsupportedError(
            f"cannot connect to {shown_url(url)!r}: Zenoh is not installed; "
            f"install it with: {install_command('zenoh')}; "
            "without it, there are dds:// (other ROS 2 robots) and ros1://host:11311 (ROS 1)"
        )
    options = ZenohOptions.parse(url, os.environ)
    from rosglass.wires.zenoh.middleware import ZenohMiddleware  # noqa: PLC0415 - an extra

    return ZenohMiddleware(options)


def _dds(url: str) -> Middleware:
    if find_spec("cyclonedds") is None:
        raise UnsupportedError(
            f"cannot connect to {url!r}: Cyclone DDS is not installed; "
            f"install it with: {install_command('dds')}; "
            "without it, there are zenoh:// (ROS 2 with rmw_zenoh) and ros1://host:11311 (ROS 1)"
        )
    if os.environ.get("ROS_SECURITY_ENABLE") == "true":
        text = "DDS Security (SROS2, ROS_SECURITY_ENABLE=true) is not supported"
        if os.environ.get("ROS_SECURITY_STRATEGY") == "Enforce":
            raise UnsupportedError(
                f"{text}, and ROS_SECURITY_STRATEGY=Enforce forbids to connect without; unset "
                "it to join the nodes without security, or use Zenoh with TLS"
            )
        _log.warning("%s: connecting without it, to nodes without it", text)
    from rosglass.wires.dds.middleware import DdsMiddleware  # noqa: PLC0415 - an extra

    return DdsMiddleware.from_url(url, os.environ)


def _local(url: str) -> Middleware:
    from rosglass.wires.local import LocalMiddleware  # noqa: PLC0415 - for tests

    return LocalMiddleware(url)
