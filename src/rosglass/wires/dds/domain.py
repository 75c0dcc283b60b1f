"""The DDS domains of this process, and their configuration from URL and environment.

Cyclone DDS configures a domain once per process. It prints configuration errors instead of
returning them, and an unknown peer name ends the process: the user's configuration is therefore
tried in a separate process first, and peers are passed as addresses only.

Elements: ``docs/manual/options.md`` of Eclipse Cyclone DDS. Ours come first, then the user's, which
override them. Discovery ranges become the same settings as in rmw_cyclonedds, so that a rosglass
node is found wherever any ROS 2 node is.
"""

from __future__ import annotations

import logging
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from rosglass.comm import Handle
from rosglass.errors import ArgumentError, ConnectionLostError, UnsupportedError
from rosglass.wires.dds import cyclone

if sys.platform == "linux":
    import fcntl

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = [
    "MAX_DOMAIN",
    "DdsOptions",
    "DiscoveryRange",
    "Domain",
    "domain_config",
    "fragment_size",
    "user_config",
]

_log = logging.getLogger("rosglass.ros2")
#: Highest domain with valid ports: 7400 + 250 * domain and some more (RTPS 2.5, section 9.6.2).
MAX_DOMAIN = 232
_EXAMPLE = "as in dds://?domain=0 or dds://192.168.1.5?domain=0"
_HOST = re.compile(r"[A-Za-z0-9_.-]+\Z")
_PEER = re.compile(r"[A-Za-z0-9_.-]+(:[0-9]{1,5})?\Z")
_INTERFACE = re.compile(r"[A-Za-z0-9_.:@-]+\Z")
_SEPARATOR = re.compile(r"[;,]")
_DISTRIBUTIONS = ("humble", "iron", "jazzy", "kilted", "lyrical", "rolling")
_KNOWN = ("domain", "range", "peers", "interface", "distro")


class DiscoveryRange(Enum):
    """The range of discovery (ROS_AUTOMATIC_DISCOVERY_RANGE, Iron and newer)."""

    SUBNET = "subnet"
    LOCALHOST = "localhost"
    OFF = "off"
    SYSTEM_DEFAULT = "system_default"


@dataclass(frozen=True)
class DdsOptions:
    """A DDS domain and its configuration.

    Attributes:
        domain: ROS domain.
        discovery: The range in which unnamed peers are discovered.
        peers: Machines to contact as well, by host name or IPv4 address; with ``:port`` only the
            program there that listens on that port.
        interfaces: Network interfaces to use, by name or address; none lets Cyclone DDS choose.
        humble: Whether to write 24-byte identities into the graph, as ROS 2 Humble does; None
            follows the others in the domain.
        config: The user's own Cyclone DDS configuration, as in ``CYCLONEDDS_URI``.
        chosen: Names of the options given in the URL.
    """

    domain: int = 0
    discovery: DiscoveryRange = DiscoveryRange.SUBNET
    peers: tuple[str, ...] = ()
    interfaces: tuple[str, ...] = ()
    humble: bool | None = None
    config: str = ""
    chosen: frozenset[str] = frozenset()

    @classmethod
    def parse(cls, url: str, env: Mapping[str, str]) -> DdsOptions:
        """Return the options in `url`, completed from the environment `env`.

        The environment is read as ROS 2 documents it: ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY (which
        overrides the next two), ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS, CYCLONEDDS_URI.

        Raises:
            ArgumentError: A part of the URL or a variable is not valid; the message names it.
        """
        hosts, options = _split(url)
        peers = (*hosts, *_list(options, "peers", _PEER, "a host name or an IPv4 address", url))
        interfaces = _list(
            options, "interface", _INTERFACE, "an interface's name or address, e.g. eth0", url
        )
        if "domain" in options:
            domain = _domain(options["domain"], "domain", url)
        else:
            domain = _domain(env.get("ROS_DOMAIN_ID") or "0", "ROS_DOMAIN_ID", "environment")
        distro = options.get("distro")
        if distro is not None and distro not in _DISTRIBUTIONS:
            raise ArgumentError("distro", distro, f"one of {', '.join(_DISTRIBUTIONS)}", url)
        discovery, others = _range(options.get("range"), bool(peers), url, env)
        return cls(
            domain=domain,
            discovery=discovery,
            peers=tuple(dict.fromkeys((*peers, *others))),
            interfaces=tuple(dict.fromkeys(interfaces)),
            humble=None if distro is None else distro == "humble",
            config=env.get("CYCLONEDDS_URI", "").strip(),
            chosen=frozenset(options) | ({"peers"} if peers else set()),
        )


def _split(url: str) -> tuple[list[str], dict[str, str]]:
    try:
        parts = urlsplit(url)
        port = parts.netloc.rpartition(":")[2] if ":" in parts.netloc else ""
    except ValueError as error:
        raise ArgumentError("url", url, f"a URL {_EXAMPLE} ({error})") from error
    if parts.path not in ("", "/") or parts.fragment or "@" in parts.netloc:
        raise ArgumentError("url", url, f"nothing but peers and options, {_EXAMPLE}")
    if port.isdigit() and parts.netloc.count(":") == 1:
        raise ArgumentError(
            "address", parts.netloc, f"no port: DDS derives it from the domain, {_EXAMPLE}", url
        )
    hosts = [host for host in _SEPARATOR.split(parts.netloc) if host]
    for host in hosts:
        _check(host, "peer", _HOST, "a host name or an IPv4 address", url)
    given = parse_qsl(parts.query, keep_blank_values=True)
    options = dict(given)
    for key, value in given:
        if key not in _KNOWN:
            raise ArgumentError("option", key, f"one of {', '.join(_KNOWN)}", url)
        if options[key] != value:
            raise ArgumentError(key, value, f"to be given once, not also {options[key]}", url)
    return hosts, options


def _range(
    option: str | None, named: bool, url: str, env: Mapping[str, str]
) -> tuple[DiscoveryRange, list[str]]:
    """Return the discovery range, and the environment's peers."""
    words = ", ".join(kind.value for kind in DiscoveryRange)
    static = env.get("ROS_STATIC_PEERS", "")
    others = [peer.strip() for peer in static.split(";") if peer.strip()]
    localhost_only = env.get("ROS_LOCALHOST_ONLY", "")
    wanted = env.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    source = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    if localhost_only not in ("", "0", "1"):
        raise ArgumentError("ROS_LOCALHOST_ONLY", localhost_only, "0 or 1", "environment")
    if option is not None:
        if option.lower() not in words.split(", "):
            raise ArgumentError("range", option, f"one of {words}", url)
        discovery, source = DiscoveryRange(option.lower()), "range"
    elif localhost_only == "1":
        discovery, source, others = DiscoveryRange.LOCALHOST, "ROS_LOCALHOST_ONLY", []
    elif wanted and wanted.lower() not in words.split(", "):
        raise ArgumentError(source, wanted, f"one of {words.upper()}", "environment")
    else:
        discovery = DiscoveryRange(wanted.lower() or "subnet")
    for peer in others:
        _check(peer, "ROS_STATIC_PEERS", _PEER, "host names or IPv4 addresses", "environment")
    if discovery in (DiscoveryRange.OFF, DiscoveryRange.SYSTEM_DEFAULT):
        reason = f"{source}={discovery.value} lets no peer be named"
        if named:
            raise ArgumentError(
                "peers", url, f"range=subnet or range=localhost beside them ({reason})"
            )
        if others:
            _log.warning("ignoring ROS_STATIC_PEERS=%s: %s", static, reason)
            others = []
    return discovery, others


def _list(
    options: Mapping[str, str], key: str, form: re.Pattern[str], expected: str, url: str
) -> list[str]:
    if key not in options:
        return []
    items = [item.strip() for item in _SEPARATOR.split(options[key]) if item.strip()]
    if not items:
        raise ArgumentError(key, options[key], expected, url)
    for item in items:
        _check(item, key, form, expected, url)
    return items


def _check(item: str, what: str, form: re.Pattern[str], expected: str, where: str) -> None:
    if not form.match(item):
        raise ArgumentError(what, item, expected, where)


def _domain(text: str, what: str, where: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text[:12]) <= MAX_DOMAIN):
        raise ArgumentError(
            what, text, f"a ROS domain: 0 to {MAX_DOMAIN}, as DDS derives its ports from it", where
        )
    return int(text)


_EXISTS = -4
#: Timeout for trying a configuration, which takes 0.05 s.
_TRIAL_TIMEOUT_S = 10.0
#: Timeout for looking up the names of all peers together.
_LOOK_UP_TIMEOUT_S = 3.0
#: Exits immediately, as there is nothing to clean up.
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
#: Time stamp, domain and thread at the beginning of a log line, and the location that ends some.
_PREFIX = re.compile(r"^\d+\.\d+ \[\w*\]\s+\S+?: ")
_PLACE = re.compile(r" \((?:CYCLONEDDS_URI\+\d+ )?line \d+\)$")
_NO_INTERFACE = re.compile(r"(\S+): does not match an available interface")
_NO_INDEX, _CROWD = "free participant index", "120 programs of this machine"

#: Maximum size of a datagram in bytes. Large samples use few datagrams and a large socket buffer:
#: with 65 kB, an image of 6 MB took 2.5 ms instead of 43, and none was lost. The kernel caps the
#: buffer at net.core.rmem_max. With its overhead, a datagram stays below 32 kB: ROS 2 on Fast DDS
#: receives into the default 208 kB, which the kernel counts in powers of two. Those of 65 kB took
#: 128 kB each, and most images never arrived.
_MAX_DATAGRAM = 31_000
#: On a network, a datagram is one packet at most. Of larger ones that lost a packet, the kernel
#: keeps the others for 30 s, in 4 MB for all programs (ipfrag_time, ipfrag_high_thresh): some
#: seconds of loss filled them, and no image arrived for 26 s afterwards. A repetition contains one
#: sample fragment at least, so a fragment must fit a packet as well: with MaxMessageSize 14720B,
#: fragments of 1344 B recovered at once, those of 2800 B and more did not. But Fast DDS on the same
#: machine gets 16 to 25 of 45 images of 6 MB at 15 Hz in these, and 45 in fragments of 30872 B.
#: Larger datagrams of small fragments do not help (15 to 30 of 45).
_MIN_DATAGRAM, _ETHERNET_MTU = 1200, 1500
#: Bytes of IPv4's and UDP's headers, and of RTPS's before a sample's fragment.
_IP_UDP_HEADERS, _RTPS_HEADERS = 28, 128
#: Requests for an interface's flags, IPv4 address and MTU, and two flags (Linux, netdevice(7)).
_GET_FLAGS, _GET_ADDRESS, _GET_MTU = 0x8913, 0x8915, 0x8921
_UP, _LOOPBACK = 0x1, 0x8
_BUFFER = '<SocketReceiveBufferSize min="default" max="10MB"/>'
#: Samples that a reader requests again are sent at once: it asks every 5 ms at most. In bursts of
#: 256 kB, Fast DDS got 35 MB/s, and images of 93 MB/s fell behind for good. Bursts of 8 MB take an
#: overloaded machine the time to receive them.
_REPEATS = (
    "<BurstSize><MaxRexmit>2MB</MaxRexmit></BurstSize>"
    "<MaxQueuedRexmitBytes>16MB</MaxQueuedRexmitBytes>"
    "<MaxQueuedRexmitMessages>20000</MaxQueuedRexmitMessages>"
)
#: Fast DDS reports losses only where a heartbeat asks it to. The one behind a sample seldom does,
#: or is lost as well, and the next followed 100 ms later.
_HEARTBEATS = '<HeartbeatInterval min="2ms" minsched="5ms">10ms</HeartbeatInterval>'
#: Without this, Fast DDS 2.9 does not notice when our readers, writers or participants leave.
_KEYS = "<GenerateKeyhash>true</GenerateKeyhash>"
#: Deleting a writer blocks no thread: all linger together (`participant.LingeringWriters`).
_LINGER = "<WriterLingerDuration>0s</WriterLingerDuration>"
#: Last participant index that others can find by unicast to this machine; higher ports belong to
#: the next domain (RTPS 2.5, section 9.6.2).
_LAST_INDEX = 119
_END = "</Domain></CycloneDDS>"
#: Allows a program any ports: others then find it by multicast, but not by its machine's name.
_ANY_PORTS = "<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"

_ADDRESS = re.compile(r"[0-9.]+\Z")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_OTHER_DOMAIN = re.compile(
    r"<domain\s[^>]*?\bid\s*=\s*[\"'](?!any)(\d+)[\"'].*?</domain\s*>", re.DOTALL | re.IGNORECASE
)
#: Elements that the user's configuration must not set together with a URL option, by its name.
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


#: The domains that this process takes part in, by number.
joined_domains: dict[int, _Joined] = {}
#: Guards them.
_lock = threading.Lock()


class Domain(Handle):
    """A domain that this process takes part in, until its last user closes it.

    Args:
        options: The domain and its configuration.

    Attributes:
        number: The ROS domain.

    Raises:
        ArgumentError: Cyclone DDS refuses the configuration; the message gives the reason.
        ConnectionLostError: A peer's name is unknown, or this machine cannot do it now.
        UnsupportedError: The process is already in the domain with another configuration, or is a
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
        """Leave the domain after its last user, whose participants are already deleted."""
        with _lock:
            joined = joined_domains.get(self.number)
            if self._closed or joined is None or joined.process != os.getpid():
                return
            self._closed = True
            joined.users -= 1
            if joined.users:
                return
            del joined_domains[self.number]
            # Deleting it would delete other users' participants.
            lib = cyclone.library()
            if joined.entity is not None and lib.dds_lookup_participant(self.number, 0, 0) < 1:
                cyclone.delete(joined.entity)


def _create(domain: int, config: str) -> int | None:
    """Return the new domain; None if something else in this process has created it."""
    if user_config(config) and (problem := _trial(domain, config)):
        _refuse(domain, config, problem)
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
        # Programs that find it without multicast try no other ports.
        if not any(part in config for part in ("<Peer ", "<AllowMulticast>false")):
            code = _create_quietly(domain, f"{config},{_ANY_PORTS}")
    if code < 0:
        _refuse(domain, config, problem or f"its code is {code}")
    _log.warning("DDS domain %d: %s, so this one is found by multicast only", domain, problem)
    return code


def _create_quietly(domain: int, config: str) -> int:
    lib = cyclone.library()
    # It prints a line for each packet that a broken link refuses, and can only be silenced
    # completely. _trial() reports configuration errors; the user's own <Tracing> still works.
    lib.dds_set_log_mask(0)
    code: int = lib.dds_create_domain(domain, config.encode())
    return code


def _refuse(domain: int, config: str, problem: str) -> None:
    interface = _NO_INTERFACE.match(problem)
    if interface:
        raise ArgumentError("interface", interface[1], f"one of this machine's ({problem})")
    own = user_config(config)
    if own and _trial(domain, config.removesuffix(f",{own}")) != problem:
        raise ArgumentError("CYCLONEDDS_URI", own, f"what Cyclone DDS accepts ({problem})")
    raise ConnectionLostError(f"Cyclone DDS cannot take part in domain {domain}: {problem}")


def _trial(domain: int, config: str) -> str:
    """Return Cyclone DDS's errors in a configuration, empty if there are none."""
    if getattr(sys, "frozen", False) or not sys.executable:
        return ""  # there is no Python interpreter to start
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
    """Return the configuration for Cyclone DDS; looks up the names of peers.

    Raises:
        ArgumentError: The URL and the user's own configuration contradict each other.
        ConnectionLostError: A peer's name is unknown.
    """
    for option, elements in _CLAIMS.items():
        said = [
            name for name in elements if option in options.chosen and _has_element(options, name)
        ]
        if said:
            raise ArgumentError(
                option,
                options.config,
                f"CYCLONEDDS_URI without <{said[0]}>, as the URL chooses that; leave out one",
            )
    ours = (
        f"<CycloneDDS><Domain>{_general(options)}<Internal>{_BUFFER}{_REPEATS}{_HEARTBEATS}{_KEYS}{_LINGER}</Internal>"
        f"{_discovery(options, _addresses(options.peers))}{_END}"
    )
    return ",".join(part for part in (ours, options.config) if part)


def user_config(config: str) -> str:
    """Return the user's part of a configuration that :func:`domain_config` returned."""
    return config.partition(f"{_END},")[2]


def _general(options: DdsOptions) -> str:
    local, size = _is_local(options), _datagram_size_of(options)
    parts = [
        f"<MaxMessageSize>{size}B</MaxMessageSize>",
        f"<FragmentSize>{size - _RTPS_HEADERS}B</FragmentSize>",
    ]
    if local:
        parts.append("<AllowMulticast>false</AllowMulticast>")
    interfaces = "".join(
        '<NetworkInterface {}="{}"/>'.format("address" if _ADDRESS.match(name) else "name", name)
        for name in options.interfaces
    )
    if interfaces:
        parts.append(f"<Interfaces>{interfaces}</Interfaces>")
    return f"<General>{''.join(parts)}</General>"


def fragment_size(options: DdsOptions) -> int:
    """Return the size in bytes of the largest sample that is sent in one piece."""
    if _has_own_size(options):
        return _MIN_DATAGRAM - _RTPS_HEADERS
    return _datagram_size_of(options) - _RTPS_HEADERS


def large_sample_advice(options: DdsOptions) -> str:
    """Return advice for large samples to Fast DDS; empty if datagrams are large already."""
    if _has_own_size(options) or _datagram_size_of(options) >= _MAX_DATAGRAM:
        return ""
    own = (
        f"<General><MaxMessageSize>{_MAX_DATAGRAM}B</MaxMessageSize>"
        f"<FragmentSize>{_MAX_DATAGRAM - _RTPS_HEADERS}B</FragmentSize></General>"
    )
    return (
        "if all subscribers run on this machine, connect to dds://?range=localhost; otherwise "
        f"publish smaller images, or export CYCLONEDDS_URI='{own}' and set the kernel of every "
        "machine that receives as rosglass doctor says there"
    )


def _has_own_size(options: DdsOptions) -> bool:
    return any(_has_element(options, name) for name in ("MaxMessageSize", "FragmentSize"))


def _is_local(options: DdsOptions) -> bool:
    return options.discovery in (DiscoveryRange.LOCALHOST, DiscoveryRange.OFF)


def _datagram_size_of(options: DdsOptions) -> int:
    return _MAX_DATAGRAM if _is_local(options) else datagram_size(options.interfaces)


@cache  # all nodes of a process have the same configuration, also after a change of the network
def datagram_size(chosen: tuple[str, ...]) -> int:
    """Return the size in bytes of the largest datagrams that need no IP fragments.

    Args:
        chosen: Names or addresses of the interfaces to use; empty for all but the loopback.
    """
    if sys.platform != "linux":
        return _ETHERNET_MTU - _IP_UDP_HEADERS
    smallest = _MAX_DATAGRAM + _IP_UDP_HEADERS
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            request = struct.pack("16s16x", name.encode()[:15])
            try:
                flags = struct.unpack_from("H", fcntl.ioctl(probe, _GET_FLAGS, request), 16)[0]
                address = socket.inet_ntoa(fcntl.ioctl(probe, _GET_ADDRESS, request)[20:24])
                mtu = struct.unpack_from("i", fcntl.ioctl(probe, _GET_MTU, request), 16)[0]
            except OSError:  # it has just disappeared, or has no address
                continue
            if flags & _UP and ({name, address} & set(chosen) if chosen else not flags & _LOOPBACK):
                smallest = min(smallest, mtu)
    return max(smallest - _IP_UDP_HEADERS, _MIN_DATAGRAM)


def _discovery(options: DdsOptions, peers: Sequence[str]) -> str:
    if options.discovery is DiscoveryRange.SYSTEM_DEFAULT:
        return ""
    if options.discovery is DiscoveryRange.OFF:
        return (
            "<Discovery><ParticipantIndex>none</ParticipantIndex>"
            f"<Tag>ros_discovery_off_{os.getpid()}</Tag>"
            '<Peers AddLocalhost="false"/></Discovery>'
        )
    # Cyclone DDS reaches this machine by the address of its interface, never by 127.0.0.1.
    others = [peer for peer in peers if not peer.startswith("127.") or ":" in peer]
    localhost = options.discovery is DiscoveryRange.LOCALHOST or len(others) < len(peers)
    # Contacted forever: a robot may be switched on hours after the cockpit.
    named = "".join(f'<Peer Address="{peer}" PruneDelay="inf"/>' for peer in others)
    around = f'<Peers AddLocalhost="{"true" if localhost else "default"}">{named}</Peers>'
    # Time to discover a peer that starts later or returns; Cyclone DDS's default is up to 30 s. A
    # named peer costs one packet for each port that a program there may use.
    interval = "2s" if others else "1s"
    return (
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{_LAST_INDEX}</MaxAutoParticipantIndex>"
        f"<SPDPInterval>{interval}</SPDPInterval>{around}</Discovery>"
    )


def _has_element(options: DdsOptions, element: str) -> bool:
    """Return whether the user's configuration has an element, for this domain or for any."""
    texts = [options.config]
    for part in options.config.split(","):
        if part and "<" not in part and ">" not in part:
            file = os.path.expandvars(part.strip().removeprefix("file://"))
            with suppress(OSError, ValueError):  # Cyclone DDS reports the problem
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
    """Return the IPv4 addresses of peers, with their ``:port`` where one was given.

    Raises:
        ConnectionLostError: A name is unknown, or no name server answers within 3 s.
    """
    found: dict[str, str] = {}
    problems: dict[str, str] = {}

    def look_up(peer: str) -> None:
        host, colon, port = peer.partition(":")
        try:
            infos = socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            problems[peer] = str(getattr(error, "strerror", None) or error)
        else:
            found[peer] = f"{infos[0][4][0]}{colon}{port}"

    threads = [threading.Thread(target=look_up, args=(peer,), daemon=True) for peer in peers]
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
