"""A client and server of two services over DDS, of any kind: `dds_services_peer.py PLAN`.

It offers `/<name>/add` (example_interfaces/srv/AddTwoInts) and `/<name>/blob`
(blob_interfaces/srv/Blob), and calls them on request from standard input. It never answers
additions of a = -1; on rosglass, it answers those of a = -2 on request, {"finish": true}.
Its types need annotations that are evaluated.
"""

import json
import sys
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from summary import report
from waiting import at_rate, eventually

# The plan: "kind" (below), "domain", "name", "serve" (which of "add" and "blob" it offers), "call"
# (services that it calls), "interfaces" (a prefix with the types), "fastdds" (that program).
plan = json.loads(sys.argv[1])
NEVER, LATER = -1, -2
#: Seconds until a server is sure to know a client that has just found it; what it gets before that
#: is lost in any DDS.
SETTLING = 0.2
ADD, BLOB = "example_interfaces::srv::dds_::AddTwoInts", "blob_interfaces::srv::dds_::Blob"


def blob(size: int) -> bytes:
    return bytes(range(251)) * (size // 251) + bytes(size % 251)


def answer(kind: str, request: Any) -> Any:
    """Return the response, None for none: sums, and bytes in reverse."""
    if kind == "blob":
        return request[::-1]
    a, b = request
    report(got=[a, b])
    return None if a == NEVER else a + b


class Rosglass:
    def __init__(self) -> None:
        import rosglass

        self.node = rosglass.connect(f"dds://?domain={plan['domain']}", plan["name"])
        self.types = {
            "add": "example_interfaces/srv/AddTwoInts",
            "blob": "blob_interfaces/srv/Blob",
        }
        self.clients: dict[str, Any] = {}
        self.promised: list[tuple[Future[Any], Any]] = []

    def serve(self, kind: str) -> None:
        def serve(request: Any) -> Any:
            given = bytes(request.data) if kind == "blob" else (request.a, request.b)
            response = answer(kind, given)
            if response is None or (kind == "add" and given[0] == LATER):
                self.promised.append((Future(), response))
                return self.promised[-1][0]
            return {"data" if kind == "blob" else "sum": response}

        name = f"/{plan['name']}/{kind}"
        self.node.create_service_server(name, self.types[kind], serve)

    def finish(self) -> None:
        for promise, response in self.promised:
            if response is not None:
                promise.set_result({"sum": response})

    def open(self, service: str, kind: str) -> None:
        client = self.node.create_service_client(service, self.types[kind])
        assert client.wait_for_server(10), client.problem
        self.clients[service] = client

    def call(self, service: str, kind: str, requests: list[Any]) -> list[Any]:
        def value(given: Any) -> dict[str, Any]:
            return {"data": given} if kind == "blob" else dict(zip("ab", given, strict=True))

        calls = [self.clients[service].call_async(value(given)) for given in requests]
        done = [call.result(10) for call in calls]
        return [bytes(r.data) if kind == "blob" else r.sum for r in done]


class Dora:
    def __init__(self) -> None:
        import dora
        import pyarrow

        self.arrow = pyarrow
        transport = dora.Ros2Transport.dds()
        context = dora.Ros2Context(
            [plan["interfaces"]], transport=transport, domain_id=plan["domain"]
        )
        self.node = context.new_node(plan["name"], "/dora", dora.Ros2NodeOptions())
        # A client's reader gets the replies to all clients. RustDDS keeps as many that were not
        # taken yet as the depth, at least 64: a client that waits for the processor would lose its
        # own reply among those that others get.
        self.qos = dora.Ros2QosPolicies(reliable=True, keep_last=1000)
        self.types = {"add": "example_interfaces/AddTwoInts", "blob": "blob_interfaces/Blob"}
        self.clients: dict[str, Any] = {}
        self.born = time.monotonic()

    def serve(self, kind: str) -> None:
        name = f"/{plan['name']}/{kind}"
        server = self.node.create_service_server(name, self.types[kind], self.qos)

        def work() -> None:
            while True:
                taken = server.take_request(1.0)
                if taken is None:
                    continue
                number, request = taken
                given = request.to_pylist()[0]
                data = bytes(given["data"]) if kind == "blob" else (given["a"], given["b"])
                response = answer(kind, data)
                if response is not None:
                    server.send_response(number, self._value(kind, response, "sum"))

        threading.Thread(target=work, daemon=True).start()

    def open(self, service: str, kind: str) -> None:
        self.clients[service] = self.node.create_service_client(service, self.types[kind], self.qos)
        # RustDDS announces ten of its readers and writers a second.
        time.sleep(max(SETTLING, self.born + 2.5 - time.monotonic()))

    def call(self, service: str, kind: str, requests: list[Any]) -> list[Any]:
        answers = []
        for given in requests:
            value = given if kind == "blob" else dict(zip("ab", given, strict=True))
            reply = self.clients[service].call(self._value(kind, value), 10.0).to_pylist()[0]
            answers.append(bytes(reply["data"]) if kind == "blob" else reply["sum"])
        return answers

    def _value(self, kind: str, value: Any, name: str = "") -> Any:
        if kind == "blob":
            octets = self.arrow.list_(self.arrow.uint8())
            kind_of = self.arrow.struct([("data", octets)])
            return self.arrow.array([{"data": list(value)}], type=kind_of)
        return self.arrow.array([{name: value} if name else value])


class Cyclone:
    """The Python API of Cyclone DDS, with the header that rmw_cyclonedds writes."""

    def __init__(self) -> None:
        from cyclonedds.core import Qos
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.idl import IdlStruct
        from cyclonedds.idl.types import int64, sequence, uint8, uint64
        from cyclonedds.pub import DataWriter
        from cyclonedds.qos import Policy
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        @dataclass
        class AddRequest(IdlStruct, typename=f"{ADD}_Request_"):
            client: uint64
            number: int64
            a: int64
            b: int64

        @dataclass
        class AddResponse(IdlStruct, typename=f"{ADD}_Response_"):
            client: uint64
            number: int64
            sum: int64

        @dataclass
        class BlobRequest(IdlStruct, typename=f"{BLOB}_Request_"):
            client: uint64
            number: int64
            data: sequence[uint8]

        @dataclass
        class BlobResponse(IdlStruct, typename=f"{BLOB}_Response_"):
            client: uint64
            number: int64
            data: sequence[uint8]

        self.types = {"add": (AddRequest, AddResponse), "blob": (BlobRequest, BlobResponse)}
        self.topic, self.reader, self.writer = Topic, DataReader, DataWriter
        self.participant = DomainParticipant(plan["domain"], Qos(Policy.Userdata(b"enclave=/;")))
        self.qos = lambda data: Qos(
            Policy.Reliability.Reliable(duration(seconds=5)),
            Policy.History.KeepAll,
            Policy.DataRepresentation(use_cdrv0_representation=True),
            Policy.Userdata(data.encode()),
        )
        self.clients: dict[str, Any] = {}

    def ends(self, service: str, kind: str, user_data: str, server: bool) -> tuple[Any, Any]:
        request, response = self.types[kind]
        requests = self.topic(self.participant, f"rq{service}Request", request)
        replies = self.topic(self.participant, f"rr{service}Reply", response)
        qos = self.qos(user_data)
        write = self.writer(self.participant, replies if server else requests, qos=qos)
        return self.reader(self.participant, requests if server else replies, qos=qos), write

    def serve(self, kind: str) -> None:
        name = f"/{plan['name']}/{kind}"
        reader, writer = self.ends(name, kind, f"serviceid= 1.10.{kind};", True)
        request_type, response = self.types[kind]

        def work() -> None:
            for _ in at_rate(0.001):
                taken = reader.take(100)
                # Other samples only report that a client is gone.
                for request in (item for item in taken if isinstance(item, request_type)):
                    given = bytes(request.data) if kind == "blob" else (request.a, request.b)
                    value = answer(kind, given)
                    if value is not None:
                        writer.write(response(request.client, request.number, value))

        threading.Thread(target=work, daemon=True).start()

    def open(self, service: str, kind: str) -> None:
        self.clients[service] = self.ends(service, kind, f"clientid= 1.10.{kind};", False)
        reader, writer = self.clients[service]
        eventually(lambda: reader.get_matched_publications() and writer.get_matched_subscriptions())

    def call(self, service: str, kind: str, requests: list[Any]) -> list[Any]:
        reader, writer = self.clients[service]
        request = self.types[kind][0]
        me, answers = 4711, {}
        for number, given in enumerate(requests):
            writer.write(request(me, number, *([given] if kind == "blob" else given)))

        def all_came() -> bool:
            for reply in reader.take(100):
                if getattr(reply, "client", None) == me:
                    value = bytes(reply.data) if kind == "blob" else reply.sum
                    answers[reply.number] = value
            return len(answers) == len(requests)

        eventually(all_came, lambda: f"{len(answers)} of {len(requests)} answers")
        return [answers[number] for number in range(len(requests))]


class Fastdds:
    """Fast DDS with the rules of rmw_fastrtps, see fastdds_peer.cpp."""

    def __init__(self) -> None:
        import struct

        import fastdds

        self.struct, self.header = struct, fastdds.CDR
        self.dds = fastdds.FastDds(plan["fastdds"], plan["domain"])
        self.types = {"add": ADD, "blob": BLOB}

    def serve(self, kind: str) -> None:
        def serve(_: int, data: bytes) -> bytes | None:
            value = answer(kind, self.decode(kind, data, "<qq"))
            return None if value is None else self.encode(kind, value)

        self.dds.serve(kind, f"{plan['name']}/{kind}", self.types[kind], serve)

    def open(self, service: str, kind: str) -> None:
        self.dds.client(service, service, self.types[kind])

    def call(self, service: str, kind: str, requests: list[Any]) -> list[Any]:
        found = self.dds.call(service, [self.encode(kind, given) for given in requests])
        values = [self.decode(kind, data, "<q") for data in found]
        return values if kind == "blob" else [value[0] for value in values]

    def decode(self, kind: str, data: bytes, layout: str) -> Any:
        if kind == "add":
            return self.struct.unpack_from(layout, data, 4)
        (size,) = self.struct.unpack_from("<I", data, 4)
        return data[8 : 8 + size]

    def encode(self, kind: str, value: Any) -> bytes:
        if kind == "blob":
            return self.header + self.struct.pack("<I", len(value)) + value
        values = value if isinstance(value, (list, tuple)) else [value]
        return self.header + self.struct.pack(f"<{len(values)}q", *values)


peer = {"rosglass": Rosglass, "dora": Dora, "cyclone": Cyclone, "fastdds": Fastdds}[plan["kind"]]()
for name in plan.get("serve", ()):
    peer.serve(name)


def work(order: dict[str, Any]) -> None:
    """Call a service, {"call": name, "sums": [[a, b]]} or {"call": name, "size": bytes}."""
    if "finish" in order:
        peer.finish()
        return
    service = order["call"]
    kind = "blob" if "size" in order else "add"
    requests = order.get("sums") or [blob(order["size"])]
    try:
        if service not in opened:
            opened.add(service)
            peer.open(service, kind)
        answers = peer.call(service, kind, requests)
    except Exception as error:
        report(answers=f"{type(error).__name__}: {error}")
        return
    report(answers=answers if kind == "add" else [answers[0] == requests[0][::-1]])


opened: set[str] = set()
pool = ThreadPoolExecutor(1)
report(ready=True)
for line in sys.stdin:
    pool.submit(work, json.loads(line))
