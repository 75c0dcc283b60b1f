"""The domains that this process takes part in: one configuration each, shared by its nodes.

Cyclone DDS configures a domain once in a process. What is wrong with a configuration it prints
instead of returning it, and a peer's unknown name ends the process: a configuration of the user's
is tried in a process of its own first, and peers are given by address only.

Elements: ``docs/manual/options.md`` of Eclipse Cyclone DDS. Ours come first, then the user's, which
win. Discovery ranges become settings as in rmw_cyclonedds, so that a program of ours is found
wherever a node of ROS 2 is.
"""

from __future__ import annotations

import logging
import os
import re
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.comm import Handle
from rosglass.errors import ArgumentError, ConnectionLostError, UnsupportedError
from rosglass.wires.dds import cyclone
from rosglass.wires.dds.options import DiscoveryRange

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rosglass.wires.dds.options import DdsOptions

__all__ = ["Domain", "domain_config", "users_part"]

_log = logging.getLogger("rosglass.ros2")
_EXISTS = -4
#: Time that trying a configuration may take; it takes 0.05 s.
_TRIAL_TIMEOUT_S = 10.0
#: Time that looking up the names of peers may take together.
_LOOK_UP_TIMEOUT_S = 3.0
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
#: Time stamp, domain and thread, which begin a line of its log, and the place that ends some.
_PREFIX = re.compile(r"^\d+\.\d+ \[\w*\]\s+\S+?: ")
_PLACE = re.compile(r" \((?:CYCLONEDDS_URI\+\d+ )?line \d+\)$")
_NO_INTERFACE = re.compile(r"(\S+): does not match an available interface")
_NO_INDEX, _CROWD = "free participant index", "120 programs of this machine"

#: Big samples in few datagrams, and room for them in the socket: with 65 kB, a picture of 6 MB took
#: 2.5 ms instead of 43, and none was lost. The kernel cuts the buffer at net.core.rmem_max.
#: Datagrams stay below 32 kB with what the kernel adds, and what is sent again goes in small
#: bursts: ROS 2 on Fast DDS receives into the default 208 kB, which the kernel counts in powers of
#: two. Datagrams of 65 kB took 128 kB each, and most pictures never arrived.
_DATAGRAMS = "<MaxMessageSize>31000B</MaxMessageSize><FragmentSize>30700B</FragmentSize>"
_BUFFER = '<SocketReceiveBufferSize min="default" max="10MB"/>'
_BURSTS = "<BurstSize><MaxRexmit>256kB</MaxRexmit></BurstSize>"
#: Fast DDS 2.9 notices no reader, writer or participant of ours that goes without this.
_KEYS = "<GenerateKeyhash>true</GenerateKeyhash>"
#: Deleting a writer holds up no thread: all linger together (`participant.Lingering`).
_LINGER = "<WriterLingerDuration>0s</WriterLingerDuration>"
#: Programs per machine that others can find by asking its ports; beyond, the ports are those of
#: the next domain (RTPS 2.5, section 9.6.2).
_LAST_INDEX = 119
_END = "</Domain></CycloneDDS>"
#: Lets a program have any ports; it is found by multicast then, but not by its machine's name.
_ANY_PORTS = "<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"

_ADDRESS = re.compile(r"[0-9.]+\Z")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_OTHER_DOMAIN = re.compile(
    r"<domain\s[^>]*?\bid\s*=\s*[\"'](?!any)(\d+)[\"'].*?</domain\s*>", re.DOTALL | re.IGNORECASE
)
#: What the user's configuration must leave alone when the URL's option of that name is given.
_CLAIMS = {
    "interface": ("Interfaces", "NetworkInterfaceAddress"),
    "range": ("AllowMulticast", "Tag"),
}


@dataclass
class _Joined:
    config: str
    entity: int | None
    process: int = field(default_factory=os.getpid)
    users: int = 1


#: What this process takes part in, by number.
joined_domains: dict[int, _Joined] = {}
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
            if any(joined.process != os.getpid() for joined in joined_domains.values()):
                raise UnsupportedError(
                    "Cyclone DDS does not work in a fork of a process that uses it; start the "
                    'process anew, with multiprocessing.set_start_method("spawn")'
                )
            joined = joined_domains.get(self.number)
            if joined is None:
                joined_domains[self.number] = _Joined(config, _create(self.number, config))
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
            joined = joined_domains.get(self.number)
            if self._closed or joined is None or joined.process != os.getpid():
                return
            self._closed = True
            joined.users -= 1
            if joined.users:
                return
            del joined_domains[self.number]
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
            code = _create_quietly(domain, f"{config},{_ANY_PORTS}")
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
            command,
            capture_output=True,
            timeout=_TRIAL_TIMEOUT_S,
            check=False,
            stdin=subprocess.DEVNULL,
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


def domain_config(options: DdsOptions) -> str:
    """Return what Cyclone DDS is to be configured with; looks up the names of peers.

    Raises:
        ArgumentError: The URL and the user's own configuration say different things.
        ConnectionLostError: A peer's name is unknown.
    """
    for option, elements in _CLAIMS.items():
        said = [name for name in elements if option in options.chosen and _says(options, name)]
        if said:
            raise ArgumentError(
                option,
                options.config,
                f"CYCLONEDDS_URI without <{said[0]}>, as the URL chooses that; leave out one",
            )
    ours = (
        f"<CycloneDDS><Domain>{_general(options)}<Internal>{_BUFFER}{_BURSTS}{_KEYS}{_LINGER}</Internal>"
        f"{_discovery(options, _addresses(options.peers))}{_END}"
    )
    return ",".join(part for part in (ours, options.config) if part)


def users_part(config: str) -> str:
    """Return the user's part of a configuration that :func:`domain_config` returned."""
    return config.partition(f"{_END},")[2]


def _general(options: DdsOptions) -> str:
    parts = [_DATAGRAMS]
    if options.discovery in (DiscoveryRange.LOCALHOST, DiscoveryRange.OFF):
        parts.append("<AllowMulticast>false</AllowMulticast>")
    interfaces = "".join(
        '<NetworkInterface {}="{}"/>'.format("address" if _ADDRESS.match(name) else "name", name)
        for name in options.interfaces
    )
    if interfaces:
        parts.append(f"<Interfaces>{interfaces}</Interfaces>")
    return f"<General>{''.join(parts)}</General>"


def _discovery(options: DdsOptions, peers: Sequence[str]) -> str:
    if options.discovery is DiscoveryRange.SYSTEM_DEFAULT:
        return ""
    if options.discovery is DiscoveryRange.OFF:
        return (
            "<Discovery><ParticipantIndex>none</ParticipantIndex>"
            f"<Tag>ros_discovery_off_{os.getpid()}</Tag>"
            '<Peers AddLocalhost="false"/></Discovery>'
        )
    # To Cyclone DDS this machine is the address of the interface it uses, never 127.0.0.1.
    others = [peer for peer in peers if not peer.startswith("127.") or ":" in peer]
    localhost = options.discovery is DiscoveryRange.LOCALHOST or len(others) < len(peers)
    # Asked for ever: a robot may be switched on hours after the cockpit.
    named = "".join(f'<Peer Address="{peer}" PruneDelay="inf"/>' for peer in others)
    around = f'<Peers AddLocalhost="{"true" if localhost else "default"}">{named}</Peers>'
    # How long it takes to find who comes later, or back; Cyclone DDS takes up to 30 s. A named peer
    # costs one packet for each port that a program may have there.
    interval = "2s" if others else "1s"
    return (
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{_LAST_INDEX}</MaxAutoParticipantIndex>"
        f"<SPDPInterval>{interval}</SPDPInterval>{around}</Discovery>"
    )


def _says(options: DdsOptions, element: str) -> bool:
    """Return whether the user's configuration has an element, for this domain or for any."""
    texts = [options.config]
    for part in options.config.split(","):
        if part and "<" not in part and ">" not in part:
            file = os.path.expandvars(part.strip().removeprefix("file://"))
            with suppress(OSError, ValueError):  # Cyclone DDS says what is wrong with it
                texts.append(Path(file).read_text(errors="replace"))
    pattern = re.compile(rf"<\s*{element}\b", re.IGNORECASE)
    return any(
        pattern.search(
            _OTHER_DOMAIN.sub(
                lambda match: match[0] if int(match[1]) == options.domain else "",
                _COMMENT.sub("", text),
            )
        )
        for text in texts
    )


def _addresses(peers: Sequence[str]) -> list[str]:
    """Return the IPv4 addresses of peers, each with its ``:port`` when it was given one.

    Raises:
        ConnectionLostError: A name is unknown, or no name server answers within 3 s.
    """
    found: dict[str, str] = {}
    problems: dict[str, str] = {}

    def look(peer: str) -> None:
        host, colon, port = peer.partition(":")
        try:
            infos = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            problems[peer] = str(getattr(error, "strerror", None) or error)
        else:
            found[peer] = f"{infos[0][4][0]}{colon}{port}"

    threads = [threading.Thread(target=look, args=(peer,), daemon=True) for peer in peers]
    until = time.monotonic() + _LOOK_UP_TIMEOUT_S
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(max(0.0, until - time.monotonic()))
    for peer in peers:
        if peer not in found:
            reason = problems.get(peer, f"no answer within {_LOOK_UP_TIMEOUT_S:.0f} s")
            raise ConnectionLostError(
                f"cannot find the address of peer {peer!r} ({reason}): write its IPv4 address, or "
                "mend the name"
            )
    return [found[peer] for peer in peers]
