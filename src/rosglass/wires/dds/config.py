"""Cyclone DDS's configuration for a domain: ours first, then the user's, which wins.

Elements: ``docs/manual/options.md`` of Eclipse Cyclone DDS. Discovery ranges become settings as in
rmw_cyclonedds, so that a program of ours is found wherever a node of ROS 2 is.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rosglass.errors import ArgumentError
from rosglass.wires.dds.options import DdsOptions, DiscoveryRange
from rosglass.wires.dds.peers import addresses

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["ANY_PORTS", "domain_config", "users_part"]

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
#: Deleting a writer holds up nobody: writers linger in lingering.py, all together.
_LINGER = "<WriterLingerDuration>0s</WriterLingerDuration>"
#: Programs per machine that others can find by asking its ports; beyond, the ports are those of
#: the next domain (RTPS 2.5, section 9.6.2).
_LAST_INDEX = 119
_END = "</Domain></CycloneDDS>"
#: Lets a program have any ports; it is found by multicast then, but not by its machine's name.
ANY_PORTS = "<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>"

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
        f"{_discovery(options, addresses(options.peers))}{_END}"
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
