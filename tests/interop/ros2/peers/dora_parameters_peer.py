"""A dora-rs node with parameters, over DDS: `dora_parameters_peer.py PLAN` with the plan as JSON.

Does as it is asked on its standard input: {"set": [name, value]}, {"get": name}.
"""

from __future__ import annotations

import json
import sys
import threading

import dora
from summary import report

# {"domain", "interfaces", "parameters": {name: value}}
plan = json.loads(sys.argv[1])
transport = dora.Ros2Transport.dds()
context = dora.Ros2Context([plan["interfaces"]], transport=transport, domain_id=plan["domain"])
options = dora.Ros2NodeOptions()
node = context.new_node("dora_node", "/dora", options, parameters=plan["parameters"])
report(ready=True)


def ask() -> None:
    for line in sys.stdin:
        request = json.loads(line)
        if "set" in request:
            node.set_parameter(*request["set"])
        else:
            report(value=node.get_parameter(request["get"]))


threading.Thread(target=ask, daemon=True).start()
threading.Event().wait(600)
