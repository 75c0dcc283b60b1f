"""Calls the service /add of examples/service_server.py in three ways.

Run it with ``python examples/service_client.py [URL]``.
"""

from __future__ import annotations

import asyncio
import sys

import rosglass


async def many(client) -> list[int]:
    """Make many calls at once."""
    calls = [client.call_async({"a": number, "b": number}) for number in range(5)]
    return [response.sum for response in await asyncio.gather(*calls)]


with rosglass.connect(sys.argv[1] if len(sys.argv) > 1 else None, "student") as node:
    # Without a type, the client uses the one that the server announces.
    client = node.create_service_client("/add")
    try:
        print("1 + 2 =", client.call({"a": 1, "b": 2}, timeout=5).sum)
    except rosglass.ServiceUnavailableError as error:
        sys.exit(f"is examples/service_server.py running? {error}")

    call = client.call_async({"a": 20, "b": 22})
    print("20 + 22 =", call.result(timeout=5).sum)

    print("in asyncio:", asyncio.run(many(client)))
