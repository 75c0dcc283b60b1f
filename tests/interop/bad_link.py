"""A cable between two machines that can lose and delay packets, beside ``two_machines.Cable``.

Run as a program it is the relay of the packets: ``bad_link.py FILE FILE``, with the numbers of the
two open TUN devices. A line on its standard input, ``LOSS DELAY``, says what happens to the packets
from then on: the part of them that is lost, and the seconds that the others take.
"""

from __future__ import annotations

import collections
import fcntl
import os
import random
import select
import struct
import subprocess
import sys
import time

from two_machines import HERE, THERE, Cable, do

__all__ = ["BadLink"]

#: Request that makes a TUN device, and its flags: IP packets without a header (Linux, if_tun.h).
_SET_INTERFACE, _TUN_WITHOUT_HEADER = 0x400454CA, 0x1001
#: Most packets that one side of the relay takes in a row.
_BURST = 64


class BadLink(Cable):
    """The robot's machine, and a link to it whose packets go through a relay. MTU 1500.

    Raises:
        OSError: TUN devices are not permitted here.
    """

    def be(self, loss: float, delay: float) -> None:
        """Lose that part of the packets from now on, and delay the others, in seconds."""
        assert self._relay.stdin is not None
        print(loss, delay, file=self._relay.stdin, flush=True)

    def close(self) -> None:
        """End the relay, all programs, and the machine."""
        self._relay.kill()
        super().close()

    def _lay(self, machine: int) -> None:
        ends = [_tun()]
        do(f"ip link set cable netns {machine}")
        ends.append(_tun())
        do(f"ip addr add {HERE} peer {THERE} dev cable")
        self.do_there(f"ip addr add {THERE} peer {HERE} dev cable")
        for run in (do, self.do_there):
            run("ip link set cable up multicast on txqueuelen 2000")
            run("ip route add 224.0.0.0/4 dev cable")
        self._relay = subprocess.Popen(
            [sys.executable, __file__, *map(str, ends)],
            stdin=subprocess.PIPE,
            pass_fds=ends,
            text=True,
        )
        for end in ends:
            os.close(end)


def _tun() -> int:
    """Return the file of a new TUN device with the name of the cable."""
    end = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(end, _SET_INTERFACE, struct.pack("16sH22x", b"cable", _TUN_WITHOUT_HEADER))
    return end


def _relay(left: int, right: int) -> None:
    loss = delay = 0.0
    waiting: collections.deque[tuple[float, int, bytes]] = collections.deque()
    while True:
        now = time.monotonic()
        while waiting and waiting[0][0] <= now:
            _, end, packet = waiting.popleft()
            try:
                os.write(end, packet)
            except OSError:  # the device is full or down
                continue
        pause = max(waiting[0][0] - now, 0) if waiting else None
        for ready in select.select([left, right, sys.stdin], [], [], pause)[0]:
            if ready is sys.stdin:
                loss, delay = map(float, sys.stdin.readline().split())
                continue
            for _ in range(_BURST):
                try:
                    packet = os.read(ready, 2048)
                except BlockingIOError:
                    break
                if random.random() >= loss:
                    due = time.monotonic() + delay
                    # In order: what is not delayed any more follows what was.
                    due = max(due, waiting[-1][0]) if waiting else due
                    waiting.append((due, left if ready == right else right, packet))


if __name__ == "__main__":
    _relay(*map(int, sys.argv[1:]))
