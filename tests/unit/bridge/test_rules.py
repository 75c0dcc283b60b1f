"""Rules of a bridge, and the examples of its documentation."""

from __future__ import annotations

import importlib.util
import threading
from pathlib import Path

import pytest

from rosglass import ConversionError, InvalidNameError, load
from rosglass.bridge import Bridge, BridgeStatus, Direction, RelayStatus, Rule
from rosglass.bridge.bridge import Rules
from rosglass.bridge.relays import Outbox
from rosglass.comm import Sample

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("text", "name", "other", "direction"),
    [
        ("/scan", "/scan", "/scan", Direction.BOTH),
        ("scan", "/scan", "/scan", Direction.BOTH),
        ("/scan:=/front/scan", "/scan", "/front/scan", Direction.BOTH),
        ("/scan<->/front", "/scan", "/front", Direction.BOTH),
        ("/scan->", "/scan", "/scan", Direction.THERE),
        ("/scan -> front", "/scan", "/front", Direction.THERE),
        ("/cmd_vel<-", "/cmd_vel", "/cmd_vel", Direction.BACK),
        ("/a <- /b", "/a", "/b", Direction.BACK),
        ("/camera/*->", "/camera/*", "/camera/*", Direction.THERE),
    ],
)
def test_rules_are_read(text, name, other, direction):
    assert Rule.parse(text) == Rule(name, other, direction)


@pytest.mark.parametrize(
    "text", ["", "->", "/a:=", "/a->/b->/c", "/a b", "/a//b", "/1", "/a/", "/*:=/b", 7, None]
)
def test_nonsense_is_refused(text):
    with pytest.raises(InvalidNameError):
        Rule.parse(text)


def test_rules_say_the_other_name():
    rules = Rules(["/a->/b", "/c", "/d<-", "/camera/*"], exclude="/camera/raw.*")
    assert [rules.other_name(0, name) for name in ("/a", "/b", "/c", "/d")] == ["/b", "", "/c", ""]
    assert [rules.other_name(1, name) for name in ("/a", "/b", "/c", "/d")] == ["", "", "/c", "/d"]
    assert rules.other_name(1, "/camera/left/image") == "/camera/left/image"
    assert rules.other_name(0, "/camera/raw_image") == ""
    assert (rules.named(0), rules.named(1)) == (["/a", "/c"], ["/c", "/d"])


def test_all_means_what_is_of_interest():
    everything = Rules(["*"])
    assert everything.other_name(0, "/scan") == "/scan"
    for name in ("/parameter_events", "/arm/_action/status", "/node/get_loggers",
                 "/node/set_parameters"):  # fmt: skip
        assert everything.other_name(0, name) == ""
    assert Rules(["*", "/parameter_events"]).other_name(0, "/parameter_events")
    # A name that is given wins over a pattern.
    assert Rules(["*", "/a->"]).other_name(1, "/a") == ""


def test_invalid_expression_is_rejected():
    with pytest.raises(ConversionError, match="exclude"):
        Rules(["*"], exclude="(")
    with pytest.raises(InvalidNameError, match=r"\['/a'\]"):
        Rules("/a")


def test_bridges_need_two_nodes():
    with pytest.raises(ConversionError, match="node_a"):
        Bridge(None, None, ["*"])


def sample(size):
    return Sample(bytes(size), "ros1", load("std_msgs/String", ros=1), 0)


def test_outbox_is_bounded_and_counts_losses():
    may_go, began = threading.Event(), threading.Event()
    sent = []

    def send(one):
        began.set()
        may_go.wait(30)
        sent.append(len(one.data))

    box = Outbox("test", send, 100)
    box.put(sample(1))
    assert began.wait(30)
    for size in (30, 40, 50, 60):
        box.put(sample(size))
    assert box.dropped == 3
    # One that is bigger than all that may wait still gets through.
    box.put(sample(1000))
    assert box.dropped == 4
    may_go.set()
    for _ in range(1000):
        if len(sent) == 2:
            break
        threading.Event().wait(0.01)
    assert sent == [1, 1000]
    box.close()
    box.close()
    box.put(sample(1))
    assert len(sent) == 2


def test_status_line():
    topic = RelayStatus("topic", "/a", "/a", "->", count=2, size=3_000_000, dropped=1)
    service = RelayStatus("service", "/s", "/s", "<-", count=1, refused=4)
    line = BridgeStatus((topic, service), ("", "")).line()
    assert line == "1 topic, 1 service: 2 messages, 3.0 MB, 1 call, 1 DROPPED, 4 REFUSED"


def test_table_in_the_documentation_is_what_the_code_does():
    spec = importlib.util.spec_from_file_location("table", ROOT / "scripts" / "bridge_table.py")
    table = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(table)
    text = table.PAGE.read_text(encoding="utf-8")
    assert text == table.page(text), "run scripts/bridge_table.py --write"
