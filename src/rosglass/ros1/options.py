"""A ROS 1 node's options, from its ``ros1://`` URL, the environment and program arguments."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, unquote, urlsplit

from rosglass.comm import anonymous_name
from rosglass.comm.names import similar
from rosglass.errors import (
    ArgumentError,
    ConversionError,
    InvalidNameError,
    ParameterError,
    RosArgumentError,
)
from rosglass.ros1.parameter_server import to_wire
from rosglass.ros1.rosparam_files import parse_value
from rosglass.wires.tcpros.address import bracketed, check_host, given_address, parse_uri
from rosglass.wires.tcpros.core import TcprosOptions
from rosglass.wires.tcpros.graph import absolute_namespace, expand, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["NO_ARGUMENTS", "Arguments", "Ros1Options"]

_log = logging.getLogger("rosglass.ros1")
_SIGN = ":="
#: How a name begins: other arguments with the sign are the program's own.
_BEGINNING = re.compile(r"[A-Za-z~/_]")
_SPECIAL = ("__name", "__ns", "__ip", "__hostname", "__master", "__log", "__tcpros_server_port")
#: ROS 2's syntax, so that one command line works for both.
_BEGIN, _END = "--ros-args", "--"
_RULE_OPTIONS = {"-r": "", "--remap": "", "-p": "_", "--param": "_"}
_RULE_EXAMPLE = "write e.g. chatter:=talk, _speed:=1.5 or __name:=left"


@dataclass(frozen=True)
class Arguments:
    """The ROS arguments of a command line, as in rospy and roscpp: ``old:=new``.

    Grammar: ROS wiki, "Remapping Arguments"; roscpp's ``init.cpp`` and ``names.cpp``, rospy's
    ``client.py``.

    Attributes:
        name: ``__name``, the node's base name; empty when not given, like all others.
        namespace: ``__ns``, absolute.
        address: ``__hostname`` or ``__ip``: the address to announce.
        master: ``__master``, the master's URI.
        tcpros_port: ``__tcpros_server_port``: where connections are accepted; 0 when not given.
        rules: Pairs of a name and its replacement, as written; the last one counts.
        parameters: Values of private parameters, by their names without ``_``.
        others: All other arguments, in order.
    """

    name: str = ""
    namespace: str = ""
    address: str = ""
    master: str = ""
    tcpros_port: int = 0
    rules: tuple[tuple[str, str], ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    others: tuple[str, ...] = ()

    @classmethod
    def parse(cls, arguments: Sequence[str]) -> Arguments:
        """Read a command line.

        Args:
            arguments: As in ``sys.argv``, with or without the program's name: ``chatter:=talk``,
                ``_speed:=1.5``, ``__name:=left``; between ``--ros-args`` and ``--`` also
                ``-r chatter:=talk`` and ``-p speed:=1.5``.

        Raises:
            RosArgumentError: An argument is not valid; the message gives the argument, the place
                and the correct form.
        """
        return _Parser(arguments).parse()

    def remappings(self, name: str, namespace: str) -> dict[str, str]:
        """Return the replacement of each remapped absolute name, for a node.

        Args:
            name: Its base name.
            namespace: Its namespace.
        """
        return {
            expand(old, name, namespace): expand(new, name, namespace) for old, new in self.rules
        }


#: For a node without ROS arguments.
NO_ARGUMENTS = Arguments()


class _Parser:
    """Parses one command line."""

    def __init__(self, arguments: Sequence[str]) -> None:
        listed = isinstance(arguments, Sequence) and not isinstance(arguments, (str, bytes))
        if not (listed and all(isinstance(argument, str) for argument in arguments)):
            raise RosArgumentError(
                "arguments must be a list of strings such as sys.argv, or "
                f"['chatter:=talk', '_speed:=1.5']; got {arguments!r}"
            )
        self._arguments = list(arguments)
        self._place = 0
        self._special: dict[str, str] = {}
        self._rules: list[tuple[str, str]] = []
        self._parameters: dict[str, Any] = {}
        self._others: list[str] = []

    def parse(self) -> Arguments:
        inside = False
        while self._place < len(self._arguments):
            argument = self._arguments[self._place]
            if argument == _BEGIN:
                inside = True
            elif inside and argument == _END:
                inside = False
            elif inside and argument.startswith("-"):
                self._option(argument)
            elif _SIGN in argument and _BEGINNING.match(argument):
                self._rule(argument)
            elif inside:
                raise self._error(f"{argument!r} is not a rule; {_RULE_EXAMPLE}")
            else:
                self._others.append(argument)
            self._place += 1
        special = self._special
        return Arguments(
            special.get("__name", ""),
            special.get("__ns", ""),
            special.get("__hostname") or special.get("__ip", ""),
            special.get("__master", ""),
            int(special.get("__tcpros_server_port", "0")),
            tuple(self._rules),
            self._parameters,
            tuple(self._others),
        )

    def _error(self, problem: str) -> RosArgumentError:
        return RosArgumentError(f"argument {self._place + 1}: {problem}")

    def _option(self, option: str) -> None:
        if option not in _RULE_OPTIONS:
            known = ", ".join(_RULE_OPTIONS)
            raise self._error(f"ROS 1 has no option {option!r}; known are {known}; {_RULE_EXAMPLE}")
        self._place += 1
        rule = self._arguments[self._place] if self._place < len(self._arguments) else ""
        if _SIGN not in rule:
            self._place -= 1
            raise self._error(
                f"{option} is followed by {rule!r}, which is not a rule; {_RULE_EXAMPLE}"
            )
        self._rule(_RULE_OPTIONS[option] + rule)

    def _rule(self, text: str) -> None:
        left, _, right = (part.strip() for part in text.partition(_SIGN))
        if not right:
            raise self._error(f"{text!r} has nothing after {_SIGN!r}; {_RULE_EXAMPLE}")
        if left.startswith("__"):
            self._set(text, left, right)
        elif left.startswith("_"):
            self._parameter(text, left[1:], right)
        else:
            for name in (left, right):
                try:
                    # Only a check: the node's own names are not known yet.
                    full = expand(name, "n", "/")
                except InvalidNameError as error:
                    raise self._error(f"{text!r}: {error}") from None
                if full in ("/", "/n"):
                    raise self._error(f"{text!r}: {name!r} is not the name of a topic or service")
            self._rules.append((left, right))

    def _set(self, text: str, key: str, value: str) -> None:
        if key == "__node":  # as in ROS 2
            key = "__name"
        if key not in _SPECIAL:
            known = ", ".join(_SPECIAL) + similar(key, _SPECIAL)
            raise self._error(f"{text!r}: {key} is unknown; known are {known}")
        try:
            if key == "__name":
                validate_node_name(value)
            elif key == "__ns":
                value = absolute_namespace(value, key)
            elif key in ("__ip", "__hostname"):
                check_host(value, key)
            elif key == "__master":
                parse_uri(value, key)
            elif key == "__tcpros_server_port":
                if not (value.isascii() and value.isdecimal() and int(value) < 65536):
                    raise ConversionError(key, value, "a port number from 0 to 65535")
            else:
                _log.info("%s has no effect here: configure Python's logging", text)
        except (InvalidNameError, ConversionError) as error:
            raise self._error(f"{text!r}: {error}") from None
        self._special[key] = value

    def _parameter(self, text: str, name: str, value: str) -> None:
        try:
            expand("~" + name, "n", "/")
            if not name:
                raise InvalidNameError("a parameter's name is missing")
            self._parameters[name] = parse_value(value, f"{name}{_SIGN}")
            to_wire(f"~{name}", self._parameters[name])
        except (InvalidNameError, ParameterError) as error:
            raise self._error(f"{text!r}: {error}") from None


_PORT = 11311
_EXAMPLE = "a URL such as ros1://robot:11311?ip=192.168.1.5"
_OPTIONS = ("anonymous", "ip", "slave_port", "tcpros_port")


@dataclass(frozen=True)
class Ros1Options(TcprosOptions):
    """A node's options.

    Attributes:
        anonymous: Whether to append a suffix to the node's name that makes it unique.
        arguments: The program's ROS arguments.
    """

    anonymous: bool = False
    arguments: Arguments = NO_ARGUMENTS

    @classmethod
    def parse(
        cls,
        url: str,
        env: Mapping[str, str] = os.environ,
        arguments: Arguments = NO_ARGUMENTS,
    ) -> Ros1Options:
        """Read a URL, with the arguments and then the environment for what it leaves out.

        Args:
            url: ``ros1://host:port?ip=...``; without host, ROS_MASTER_URI, or this machine.
            env: ROS_MASTER_URI, ROS_IP and ROS_HOSTNAME are used.
            arguments: They override the environment; the URL overrides both.

        Raises:
            ArgumentError: A part of the URL or an environment variable is not valid.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise ArgumentError("url", url, f"{_EXAMPLE} ({error})") from error
        host = unquote(host or "")
        if parts.path not in ("", "/") or parts.fragment or "@" in parts.netloc or port == 0:
            raise ArgumentError("url", url, _EXAMPLE)
        if " " in host or not host.isprintable():
            raise ArgumentError("url", url, f"{_EXAMPLE} ({host!r} is not a host)")
        options = _options(parts.query, url)
        if host or port:
            master = f"http://{bracketed(host or 'localhost')}:{port or _PORT}"
            source = "url"
        elif arguments.master:
            master, source = arguments.master, "__master"
        else:
            master, source = env.get("ROS_MASTER_URI", "").strip(), "ROS_MASTER_URI"
            master = master or f"http://localhost:{_PORT}"
        parse_uri(master, source)
        if not master.startswith("http://"):
            raise ArgumentError(source, master, "a URI such as http://robot:11311")
        if "ip" in options:
            address, given_by = check_host(options["ip"], "url option ip"), "ip"
        elif arguments.address:
            address, given_by = arguments.address, "__ip"
        else:
            address, given_by = given_address(env)
        return cls(
            master.rstrip("/"),
            address,
            given_by,
            _port(options, "tcpros_port") or arguments.tcpros_port,
            _port(options, "slave_port"),
            _flag(options, "anonymous"),
            arguments,
        )

    def node_name(self, name: str | None) -> str:
        """Return the node's base name.

        Args:
            name: The program's own choice, which ``__name`` replaces; None for a unique name: in
                ROS, a second node of the same name shuts the first one down.
        """
        if self.arguments.name:
            return self.arguments.name
        return anonymous_name(name or "rosglass") if name is None or self.anonymous else name

    def namespace(self, given: str | None, env: Mapping[str, str] = os.environ) -> str:
        """Return the node's namespace.

        Args:
            given: The program's own choice, which ``__ns`` replaces; None and ``/`` for
                ROS_NAMESPACE.
            env: ROS_NAMESPACE is used.

        Raises:
            InvalidNameError: The namespace breaks ROS's rules.
        """
        if self.arguments.namespace:
            return self.arguments.namespace
        if given not in (None, "/"):
            return absolute_namespace(given, "namespace", relative=False)
        return absolute_namespace(env.get("ROS_NAMESPACE", "").strip() or "/", "ROS_NAMESPACE")


def _options(query: str, url: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in parse_qsl(query, keep_blank_values=True):
        if name not in _OPTIONS:
            raise ArgumentError(f"url option {name}", url, f"one of {', '.join(_OPTIONS)}")
        if name in found or not value:
            raise ArgumentError(f"url option {name}", url, "each option once, with a value")
        found[name] = value
    return found


def _port(options: Mapping[str, str], name: str) -> int:
    text = options.get(name, "0")
    if not (text.isascii() and text.isdecimal()) or int(text) > 65535:
        raise ArgumentError(f"url option {name}", text, "a port number from 0 to 65535")
    return int(text)


def _flag(options: Mapping[str, str], name: str) -> bool:
    text = options.get(name, "false").lower()
    if text not in ("true", "false"):
        raise ArgumentError(f"url option {name}", text, "true or false")
    return text == "true"
