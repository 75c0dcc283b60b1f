"""Moves a Fast DDS process (fastdds_peer.cpp), whose part in DDS it is; this is the node's."""

from __future__ import annotations

import json
import subprocess
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

#: Seconds after its start when it is known to those it meets, and it knows their endpoints: some
#: are announced only with its next heartbeat, each second.
KNOWN = 1.3
#: Seconds until what it makes later is known.
SETTLING = 0.2
CDR = b"\0\1\0\0"


class FastDds:
    """A Fast DDS participant.

    Args:
        program: The built peer.
        domain: ROS domain.
    """

    def __init__(self, program: str, domain: int) -> None:
        self._process = subprocess.Popen(
            [program, str(domain)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._born = time.monotonic()
        self._changed = threading.Condition()
        self._matched: dict[str, tuple[int, int]] = {}
        self._answers: dict[tuple[str, int], bytes] = {}
        self._serve: dict[str, Callable[[int, bytes], bytes | None]] = {}
        self._take: dict[str, Callable[[bytes], None]] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def close(self) -> None:
        self._process.kill()
        self._process.wait()

    def serve(
        self, name: str, service: str, dds_type: str, answer: Callable[[int, bytes], bytes | None]
    ) -> None:
        """Offer a service; `answer` is given a number for reply(), or returns the response."""
        self._serve[name] = answer
        self._say("server", name, service.lstrip("/"), dds_type)

    def reply(self, name: str, number: int, data: bytes) -> None:
        self._say("reply", name, number, data.hex())

    def client(self, name: str, service: str, dds_type: str) -> None:
        """Become a client of a service, and wait until both sides know."""
        self._say("client", name, service.lstrip("/"), dds_type)
        self.wait_matched(name, 1, 1)

    def call(self, name: str, requests: list[bytes]) -> list[bytes]:
        """Call a service several times at once; returns the answers in order."""
        keys = [(name, number) for number in range(len(requests))]
        for number, data in enumerate(requests):
            # Its depth is 10, as rmw's: of more at once it forgets those that must be sent again.
            self._wait(lambda n=number: n - len(self._answered(name)) < 8)
            self._say("call", name, number, data.hex())
        self._wait(lambda: len(self._answered(name)) == len(keys))
        return [self._answers.pop(key) for key in keys]

    def publish(self, name: str, topic: str, dds_type: str, options: str = "") -> None:
        self._say("pub", name, f"rt{topic}", dds_type, options)

    def send(self, name: str, data: bytes) -> None:
        self._say("send", name, data.hex())

    def subscribe(
        self, name: str, topic: str, dds_type: str, take: Callable[[bytes], None], options: str = ""
    ) -> None:
        self._take[name] = take
        self._say("sub", name, f"rt{topic}", dds_type, options)

    def wait_matched(self, name: str, readers: int, writers: int) -> None:
        def matched() -> bool:
            here = self._matched.get(name, (0, 0))
            return here[0] >= readers and here[1] >= writers

        self._wait(matched)
        time.sleep(max(SETTLING, self._born + KNOWN - time.monotonic()))

    def _answered(self, name: str) -> list[tuple[str, int]]:
        return [key for key in self._answers if key[0] == name]

    def _wait(self, condition: Callable[[], bool]) -> None:
        with self._changed:
            if not self._changed.wait_for(condition, 30):
                raise TimeoutError(f"matched {self._matched}, answered {list(self._answers)}")

    def _say(self, *words: object) -> None:
        assert self._process.stdin is not None
        with self._changed, suppress(BrokenPipeError):  # it was ended
            self._process.stdin.write(" ".join(map(str, words)) + "\n")
            self._process.stdin.flush()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._handle(json.loads(line))

    def _handle(self, event: dict[str, Any]) -> None:
        data = bytes.fromhex(event.get("data", ""))
        if "request" in event:
            name, number = event["request"], event["number"]
            response = self._serve[name](number, data)
            if response is not None:
                self.reply(name, number, response)
        elif "received" in event:
            self._take[event["received"]](data)
        with self._changed:
            if "matched" in event:
                self._matched[event["matched"]] = (event["readers"], event["writers"])
            elif "reply" in event:
                self._answers[event["reply"], event["number"]] = data
            self._changed.notify_all()
