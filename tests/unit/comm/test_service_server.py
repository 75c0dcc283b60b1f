"""A service server's requests, in the orders and at the moments that wires can produce."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

from rosglass.comm import QoS
from rosglass.comm.executor import IMMEDIATE, LoopExecutor
from rosglass.comm.handle import Executor
from rosglass.comm.service_server import ServiceServer
from rosglass.comm.wire import Replier, RequestId
from rosglass.messages import load

ADD: Any = load("rospy_tutorials/AddTwoInts", ros=1)


class Core:
    """The parts of a node that a server needs."""

    forked = False
    dispatcher = IMMEDIATE

    def __init__(self) -> None:
        self.servers: set[Any] = set()

    def add(self, _: Any) -> None:
        """Nothing to follow."""

    def remove(self, _: Any) -> None:
        """Nothing to follow."""


class Recorder(Replier):
    """Collects replies."""

    def __init__(self) -> None:
        self.replies: list[tuple[int, bytes]] = []

    def reply(self, request: RequestId, data: bytes | bytearray) -> None:
        self.replies.append((request.sequence, bytes(data)))

    def close(self) -> None:
        """Nothing to withdraw."""


def request(number: int) -> tuple[RequestId, bytes]:
    return RequestId(b"client", number), ADD.request.encode({"a": number})


def test_requests_that_come_before_the_replier_is_there_are_served_first() -> None:
    replier, served = Recorder(), []
    receive: list[Any] = []

    class Interleaved(Executor):
        """While the first request is handed on, the wire's thread receives another one."""

        def post(self, job: Any) -> None:
            if not served and len(receive) == 1:
                receive.append(None)
                thread = threading.Thread(target=receive[0], args=request(3))
                thread.start()
                thread.join(30)
            job()

    def create(on_request: Any, _: bool) -> Replier:
        receive.append(on_request)
        on_request(*request(1))
        on_request(*request(2))
        return replier

    def serve(asked: Any) -> dict[str, int]:
        served.append(asked.a)
        return {"sum": asked.a}

    core: Any = Core()
    ServiceServer(core, "/add", ADD, serve, QoS.services(), Interleaved(), create)
    assert served == [1, 2, 3]
    assert [number for number, _ in replier.replies] == [1, 2, 3]


def test_coroutine_that_begins_as_the_server_is_closed_is_cancelled() -> None:
    servers: list[ServiceServer] = []

    class Closing(LoopExecutor):
        """The server is closed, by another thread, between the callback and its coroutine."""

        def run(self, coroutine: Any) -> Any:
            servers[0].close()
            return super().run(coroutine)

    async def slow(_: Any) -> dict[str, int]:
        await asyncio.sleep(60)
        return {"sum": 0}

    async def main() -> None:
        loop = asyncio.get_running_loop()
        receive: list[Any] = []
        core: Any = Core()

        def create(on_request: Any, _: bool) -> Replier:
            receive.append(on_request)
            return Recorder()

        servers.append(ServiceServer(core, "/add", ADD, slow, QoS.services(), None, create))
        servers[0]._executor = Closing(loop)
        receive[0](*request(1))
        for _ in range(100):
            await asyncio.sleep(0)
        others = asyncio.all_tasks(loop) - {asyncio.current_task()}
        assert not others

    asyncio.run(main())
