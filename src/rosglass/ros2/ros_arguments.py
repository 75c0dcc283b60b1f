"""The command line arguments after ``--ros-args``: names, parameters, log levels.

Grammar and precedence: design articles "ROS Command Line Arguments" and "Remapping Names", and
``rcl``'s argument parser. Where they differ, this follows rcl: wildcards in remapping rules were
designed, but never implemented.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from rosglass.comm.names import expand, validate_namespace, validate_node_name
from rosglass.errors import InvalidNameError, ParameterError, RosArgumentError
from rosglass.ros2.parameter_files import matches, parse_value, read

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosglass.comm import ParameterValue

__all__ = ["LOG_LEVELS", "NO_ARGUMENTS", "Arguments", "RemapRule"]

_log = logging.getLogger("rosglass.ros2")
#: Names of the levels (rcutils), upper case, and their numbers, which are also :mod:`logging`'s.
LOG_LEVELS = {"UNSET": 0, "DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
_BEGIN, _END = "--ros-args", "--"
_NODE_PREFIX = re.compile(r"([A-Za-z_]\w*):(?!=|//)", re.ASCII)
_SCHEMES = {"rostopic://": "topic", "rosservice://": "service"}
_SWITCHES = ("rosout", "stdout", "external-lib")
#: Options that Python's logging replaces; accepted, because launch files pass them.
_WITHOUT_EFFECT = ("--log-file-name", "--log-config-file")
_EXAMPLES = {
    "--remap": "-r chatter:=talk",
    "--param": "-p speed:=1.5",
    "--params-file": "--params-file robot.yaml",
    "--log-level": "--log-level debug",
    "--enclave": "--enclave /robot",
}
_OPTIONS = {
    "-r": "--remap",
    "--remap": "--remap",
    "-p": "--param",
    "--param": "--param",
    "--params-file": "--params-file",
    "--log-level": "--log-level",
    "-e": "--enclave",
    "--enclave": "--enclave",
    **{name: name for name in _WITHOUT_EFFECT},
}


class RemapRule(NamedTuple):
    """One remapping rule.

    Attributes:
        kind: The kind of names: ``name`` (topics and services), ``topic``, ``service``, ``__node``
            or ``__ns``.
        node: Base name of the node that it applies to, empty for all.
        match: The name to replace, as written; empty for a node's name and namespace.
        replacement: The name to use, as written.
    """

    kind: str
    node: str
    match: str
    replacement: str


class _Assignment(NamedTuple):
    """Parameters for the nodes that `target` names, in a file or with ``-p``.

    Attributes:
        target: A full name, possibly with wildcards; or a base name, without a slash.
        values: The parameters.
    """

    target: str
    values: Mapping[str, ParameterValue]


@dataclass(frozen=True)
class Arguments:
    """The arguments after ``--ros-args``.

    Attributes:
        rules: Remapping rules, in order; the first that matches counts.
        log_level: Minimum level of the node's logger; None if not given.
        logger_levels: The same for individual loggers, by name.
        rosout: Whether log messages are published on ``/rosout``.
        stdout: Whether log messages are passed to Python's log handlers, and so to the terminal.
        others: The remaining arguments, in order.
    """

    rules: tuple[RemapRule, ...] = ()
    log_level: int | None = None
    logger_levels: Mapping[str, int] = field(default_factory=dict)
    rosout: bool = True
    stdout: bool = True
    others: tuple[str, ...] = ()
    _assignments: tuple[_Assignment, ...] = ()

    @classmethod
    def parse(cls, arguments: Sequence[str]) -> Arguments:
        """Read a command line.

        Args:
            arguments: As in ``sys.argv``, with or without the program's name. Sections from
                ``--ros-args`` to ``--`` (or the end) are read; there may be any number of them.

        Raises:
            RosArgumentError: An argument is not valid; the message has the argument, its place and
                what to write instead. Also if a parameter file is not valid.
        """
        return _Parser(arguments).parse()

    def node_name(self, name: str) -> str:
        """Return the remapped base name of the node called `name`."""
        return self._renamed("__node", name) or name

    def namespace(self, name: str, namespace: str) -> str:
        """Return the remapped namespace of the node with the (new) base name `name`."""
        return self._renamed("__ns", name) or namespace

    def remappings(self, kind: str, name: str, namespace: str) -> dict[str, str]:
        """Return the new names of topics or services, by absolute name.

        Args:
            kind: ``topic`` or ``service``.
            name: Base name of the node that uses them.
            namespace: Its namespace.

        Raises:
            RosArgumentError: A rule expands to a name that is not valid.
        """
        found: dict[str, str] = {}
        for rule in self.rules:
            if rule.kind not in ("name", kind) or rule.node not in ("", name):
                continue
            try:
                match = expand(rule.match, name, namespace)
                found.setdefault(match, expand(rule.replacement, name, namespace))
            except InvalidNameError as error:
                written = f"{rule.match}:={rule.replacement}"
                raise RosArgumentError(
                    f"--ros-args -r {written} cannot be applied to node {name} in {namespace}: "
                    f"{error}"
                ) from None
        return found

    def parameters(self, node: str) -> dict[str, ParameterValue]:
        """Return the parameters given for the node with the full name `node`.

        Rules that name the node win over those for all nodes; otherwise the last wins.
        """
        values: dict[str, ParameterValue] = {}
        base = node.rpartition("/")[2]
        for exact in (False, True):
            for target, given in self._assignments:
                if exact is not ("*" not in target):
                    continue
                if target == base if "/" not in target else matches(target, node):
                    values.update(given)
        return values

    def _renamed(self, kind: str, name: str) -> str:
        for rule in self.rules:
            if rule.kind == kind and rule.node in ("", name):
                return rule.replacement
        return ""


#: The arguments of a node without any.
NO_ARGUMENTS = Arguments()


class _Parser:
    """Parses a command line."""

    def __init__(self, arguments: Sequence[str]) -> None:
        listed = isinstance(arguments, Sequence) and not isinstance(arguments, (str, bytes))
        if not (listed and all(isinstance(argument, str) for argument in arguments)):
            raise RosArgumentError(
                "arguments must be a list of texts such as sys.argv, or "
                f"['--ros-args', '-r', 'chatter:=talk']; got {arguments!r}"
            )
        self._arguments = list(arguments)
        self._place = 0
        self._rules: list[RemapRule] = []
        self._assignments: list[_Assignment] = []
        self._level: int | None = None
        self._levels: dict[str, int] = {}
        self._switches = dict.fromkeys(_SWITCHES, True)
        self._others: list[str] = []

    def parse(self) -> Arguments:
        inside = False
        while self._place < len(self._arguments):
            argument = self._arguments[self._place]
            if argument == _BEGIN:
                inside = True
            elif not inside:
                self._others.append(argument)
                self._warn_of_old_rule(argument)
            elif argument == _END:
                inside = False
            else:
                self._option(argument)
            self._place += 1
        return Arguments(
            tuple(self._rules),
            self._level,
            self._levels,
            self._switches["rosout"],
            self._switches["stdout"],
            tuple(self._others),
            tuple(self._assignments),
        )

    def _warn_of_old_rule(self, argument: str) -> None:
        if ":=" in argument and not argument.startswith("-"):
            _log.warning(
                "%r stands outside of %s and changes nothing; write %s -r %s",
                argument,
                _BEGIN,
                _BEGIN,
                argument,
            )

    def _option(self, argument: str) -> None:
        if self._switch(argument):
            return
        # --param=name:=value is accepted, too, as users expect it.
        written, equals, value = argument.partition("=")
        glued = bool(equals) and written.startswith("--") and not written.endswith(":")
        option = _OPTIONS.get(written if glued else argument)
        if option is None:
            known = ", ".join(sorted({*_OPTIONS, "--enable-rosout-logs", "--disable-rosout-logs"}))
            raise self._error(f"unknown option {argument!r}; known are {known}; -- ends them")
        if not glued:
            value = self._value(option, argument)
        if option == "--remap":
            self._rules.append(self._rule(value))
        elif option == "--param":
            self._assignments.append(self._parameter(value))
        elif option == "--params-file":
            self._file(value)
        elif option == "--log-level":
            self._log_level(value)
        elif option == "--enclave":
            self._enclave(value)
        else:
            _log.warning("%s %s has no effect here: configure Python's logging", option, value)

    def _switch(self, argument: str) -> bool:
        for name in _SWITCHES:
            for verb in ("enable", "disable"):
                if argument == f"--{verb}-{name}-logs":
                    self._switches[name] = verb == "enable"
                    return True
        return False

    def _value(self, option: str, written: str) -> str:
        self._place += 1
        if self._place < len(self._arguments):
            value = self._arguments[self._place]
            if value not in (_BEGIN, _END):
                return value
        self._place -= 1
        example = _EXAMPLES.get(option, f"{option} NAME")
        raise self._error(f"nothing follows {written}; write e.g. {example}")

    def _error(self, problem: str) -> RosArgumentError:
        return RosArgumentError(f"{_BEGIN}, argument {self._place + 1}: {problem}")

    def _split(self, text: str, option: str) -> tuple[str, str, str, int]:
        """Return node, left, right of ``node:left:=right``, and the position of right."""
        left, separator, right = text.partition(":=")
        example = _EXAMPLES[option]
        if not separator:
            raise self._error(f"{text!r} has no ':='; write e.g. {example}")
        prefix = _NODE_PREFIX.match(left)
        if prefix and ":" not in left[prefix.end() :].replace("://", ""):
            node, left = prefix[1], left[prefix.end() :]
        else:
            node = ""
        if not left:
            raise self._error(f"{text!r} has no name before ':='; write e.g. {example}")
        return node, left, right, len(text) - len(right)

    def _rule(self, text: str) -> RemapRule:
        node, left, right, start = self._split(text, "--remap")
        if not right:
            raise self._error(
                f"{text!r} has no new name after ':=' (position {start}); write e.g. "
                f"{_EXAMPLES['--remap']}"
            )
        if left in ("__node", "__name", "__ns"):
            return self._naming(text, node, left, right)
        kind = "name"
        for scheme, what in _SCHEMES.items():
            if left.startswith(scheme):
                kind, left = what, left.removeprefix(scheme)
        for side, name in (("old", left), ("new", right)):
            self._check_name(text, side, name)
        return RemapRule(kind, node, left, right)

    def _naming(self, text: str, node: str, left: str, right: str) -> RemapRule:
        try:
            if left == "__ns":
                right = right.rstrip("/") or "/"
                validate_namespace(right)
            else:
                validate_node_name(right)
        except InvalidNameError as error:
            raise self._error(f"{text!r}: {error}") from None
        return RemapRule("__ns" if left == "__ns" else "__node", node, "", right)

    def _check_name(self, text: str, side: str, name: str) -> None:
        where = f"{text!r}: the {side} name {name!r}"
        if "*" in name or "\\" in name:
            raise self._error(
                f"{where} has a wildcard; ROS 2's rules name one topic or service each"
            )
        if name == "~" or "{" in name or "}" in name:
            raise self._error(f"{where} is not a name; write '~/name' for a private one")
        try:
            # With the shortest names possible: the rule's effect on a node is checked later.
            expand(name, "n", "/")
        except InvalidNameError as error:
            raise self._error(f"{text!r}: {error}") from None

    def _parameter(self, text: str) -> _Assignment:
        node, name, value, start = self._split(text, "--param")
        bad = re.search(r"[\s:*]|\.\.|^\.|\.$", name)
        if bad:
            raise self._error(
                f"{text!r}: {name!r} is not a parameter name ({bad[0]!r} at position {bad.start()})"
            )
        if not value.strip():
            raise self._error(
                f"{text!r} has no value after ':=' (position {start}); an empty text is written "
                f"-p \"{name}:=''\""
            )
        try:
            return _Assignment(node or "/**", {name: parse_value(value, f"{name}:=")})
        except ParameterError as error:
            raise self._error(f"{text!r}: {error}") from None

    def _file(self, path: str) -> None:
        try:
            self._assignments += [_Assignment(*entry) for entry in read(path).entries]
        except ParameterError as error:
            raise self._error(f"--params-file: {error}") from None

    def _log_level(self, text: str) -> None:
        logger, separator, level = text.rpartition(":=")
        number = LOG_LEVELS.get(level.upper())
        if number is None:
            levels = ", ".join(LOG_LEVELS).lower()
            raise self._error(f"--log-level {text!r}: {level!r} is not a level; known are {levels}")
        if not separator:
            self._level = number
        elif logger:
            self._levels[logger] = number
        else:
            raise self._error(f"--log-level {text!r} has no logger's name before ':='")

    def _enclave(self, text: str) -> None:
        try:
            validate_namespace(text)
        except InvalidNameError as error:
            raise self._error(f"--enclave {text!r}: {error}") from None
        # A user who names one expects encryption.
        _log.warning("--enclave %s has no effect: this node's traffic is not secured", text)
