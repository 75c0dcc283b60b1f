"""The domains that this process takes part in: one configuration each, shared by its nodes.

Cyclone DDS configures a domain once in a process. What is wrong with a configuration it prints
instead of returning it, and a peer's unknown name ends the process, so a configuration of the
user's is tried in a process of its own first.
"""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rosglass.comm import Handle
from rosglass.errors import ArgumentError, ConnectionLostError, UnsupportedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.config import ANY_PORTS, domain_config, users_part

if TYPE_CHECKING:
    from rosglass.wires.dds.options import DdsOptions

__all__ = ["Domain"]

_log = logging.getLogger("rosglass.ros2")
_EXISTS = -4
#: Seconds that trying a configuration may take; it takes 0.05.
_PATIENCE = 10.0
#: Ends at once, as there is nothing to be tidied up.
_TRY = """
import ctypes, os, sys
library = ctypes.CDLL(sys.argv[1])
library.dds_create_domain.argtypes = [ctypes.c_uint32, ctypes.c_char_p]
library.dds_create_participant.argtypes = [ctypes.c_uint32, ctypes.c_void_p, ctypes.c_void_p]
domain = int(sys.argv[2])
failed = library.dds_create_domain(domain, os.fsencode(sys.argv[3])) < 0
failed = failed or library.dds_create_participant(domain, None, None) < 0
os._exit(int(failed))
"""
#: Time, domain and thread, which begin a line of Cyclone DDS's log, and the place that ends some.
_PREFIX = re.compile(r"^\d+\.\d+ \[\w*\]\s+\S+?: ")
_PLACE = re.compile(r" \((?:CYCLONEDDS_URI\+\d+ )?line \d+\)$")
_NO_INTERFACE = re.compile(r"(\S+): does not match an available interface")
_NO_INDEX, _CROWD = "free participant index", "120 programs of this machine"


@dataclass
class _Joined:
    config: str
    entity: int | None
    process: int = field(default_factory=os.getpid)
    users: int = 1


_joined: dict[int, _Joined] = {}
_lock = threading.Lock()


class Domain(Handle):
    """A domain that this process takes part in; the last one who closes it leaves it.

    Args:
        options: Which one, and how.

    Attributes:
        number: The ROS domain.

    Raises:
        ArgumentError: Cyclone DDS refuses the configuration; it says what is wrong.
        ConnectionLostError: A peer's name is unknown, or this machine cannot do it now.
        UnsupportedError: The process is in the domain already with another configuration, or is a
            fork of one that uses DDS.
    """

    def __init__(self, options: DdsOptions) -> None:
        self.number = options.domain
        self._closed = False
        config = domain_config(options)
        with _lock:
            if any(joined.process != os.getpid() for joined in _joined.values()):
                raise UnsupportedError(
                    "Cyclone DDS does not work in a fork of a process that uses it; start the "
                    'process anew, with multiprocessing.set_start_method("spawn")'
                )
            joined = _joined.get(self.number)
            if joined is None:
                _joined[self.number] = _Joined(config, _create(self.number, config))
            elif joined.config != config:
                raise UnsupportedError(
                    f"this process is in DDS domain {self.number} with other settings, and "
                    "Cyclone DDS has one configuration for a domain in a process: use the same "
                    "range, peers and interface for all nodes in it, or connect in another "
                    f"process (in use: {joined.config}; wanted: {config})"
                )
            else:
                joined.users += 1

    def close(self) -> None:
        """Leave the domain when this was its last user, who has deleted the participants before."""
        with _lock:
            joined = _joined.get(self.number)
            if self._closed or joined is None or joined.process != os.getpid():
                return
            self._closed = True
            joined.users -= 1
            if joined.users:
                return
            del _joined[self.number]
            # Others' participants would go with it.
            lib = cyclone.library()
            if joined.entity is not None and lib.dds_lookup_participant(self.number, 0, 0) < 1:
                cyclone.delete(joined.entity)


def _create(domain: int, config: str) -> int | None:
    """Return the new domain; None when something else in this process has created it."""
    if users_part(config):
        _check(domain, config)
    code = _create_quietly(domain, config)
    if code == _EXISTS:
        _log.warning(
            "something else in this process takes part in DDS domain %d: its settings stay, and "
            "ours do not apply",
            domain,
        )
        return None
    if code >= 0:
        return code
    problem = _trial(domain, config)
    if _NO_INDEX in problem:
        problem = f"{_CROWD} are in it already ({problem})"
        # Those who are to find it without multicast know no other ports.
        if not any(part in config for part in ("<Peer ", "<AllowMulticast>false")):
            code = _create_quietly(domain, f"{config},{ANY_PORTS}")
    if code < 0:
        _refuse(domain, config, problem or f"its code is {code}")
    _log.warning("DDS domain %d: %s, so this one is found by multicast only", domain, problem)
    return code


def _create_quietly(domain: int, config: str) -> int:
    lib = cyclone.library()
    # It prints a line for each packet that a broken link refuses, and can only be told to print
    # nothing. What it has against a configuration is found out in _trial(); a <Tracing> of the
    # user's works all the same.
    lib.dds_set_log_mask(0)
    code: int = lib.dds_create_domain(domain, config.encode())
    return code


def _check(domain: int, config: str) -> None:
    problem = _trial(domain, config)
    if problem:
        _refuse(domain, config, problem)


def _refuse(domain: int, config: str, problem: str) -> None:
    interface = _NO_INTERFACE.match(problem)
    if interface:
        raise ArgumentError("interface", interface[1], f"one of this machine's ({problem})")
    own = users_part(config)
    if own and _trial(domain, config.removesuffix(f",{own}")) != problem:
        raise ArgumentError("CYCLONEDDS_URI", own, f"what Cyclone DDS accepts ({problem})")
    raise ConnectionLostError(f"Cyclone DDS cannot take part in domain {domain}: {problem}")


def _trial(domain: int, config: str) -> str:
    """Return what Cyclone DDS has against a configuration, empty when it takes it."""
    if getattr(sys, "frozen", False) or not sys.executable:
        return ""  # what would be started is no Python
    library = cyclone.library()._name
    command = [sys.executable, "-I", "-S", "-c", _TRY, library, str(domain), config]
    try:
        ended = subprocess.run(
            command, capture_output=True, timeout=_PATIENCE, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        _log.warning("cannot try the configuration of DDS domain %d: %s", domain, error)
        return ""
    if ended.returncode == 0:
        return ""
    lines = [
        _PLACE.sub("", _PREFIX.sub("", line)).strip()
        for line in ended.stderr.decode(errors="replace").splitlines()
    ]
    return "; ".join(line for line in lines if line) or f"it ends with code {ended.returncode}"
