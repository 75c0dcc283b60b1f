from __future__ import annotations

import copy
import pickle

import pytest

import rosglass
from rosglass.messages import OpaqueType

HASH = "RIHS01_" + "ab" * 32
SECRET = OpaqueType("secret_msgs/msg/Thing", HASH, "no node has it")


def test_name_and_hash_are_known():
    assert (SECRET.name, SECRET.rihs01, SECRET.ros, SECRET.wire) == (
        "secret_msgs/msg/Thing",
        HASH,
        2,
        "cdr",
    )
    assert OpaqueType("secret_msgs/Thing").name == "secret_msgs/msg/Thing"
    assert OpaqueType("p/action/Do_FeedbackMessage").rihs01 == ""
    assert repr(SECRET) == "<OpaqueType secret_msgs/msg/Thing>"


@pytest.mark.parametrize(
    "use",
    [
        lambda t: t.decode(b"\0\1\0\0data"),
        lambda t: t.decode(b"????"),
        lambda t: t.decode_all(b"\0\1\0\0data"),
        lambda t: t.validate(b"\0\1\0\0data"),
        lambda t: t.validate(b"????"),
        lambda t: t.decode_checked(b"\0\1\0\0data"),
        lambda t: t.encode({"a": 1}),
        lambda t: t.create(a=1),
        lambda t: t(a=1),
        lambda t: t.path("a"),
        lambda t: t.fields,
        lambda t: t.constants,
        lambda t: t.definition,
    ],
)
def test_whatever_needs_the_definition_says_why_there_is_none(use):
    with pytest.raises(rosglass.TypeNotFoundError, match=r"secret_msgs/msg/Thing.*no node has it"):
        use(SECRET)


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda t: pickle.loads(pickle.dumps(t))]
)
def test_copies_are_equal(copied):
    twin = copied(SECRET)
    assert twin == SECRET
    assert hash(twin) == hash(SECRET)
    assert twin.reason == SECRET.reason
    assert OpaqueType(SECRET.name) != SECRET
    assert rosglass.load("std_msgs/msg/String") != SECRET


@pytest.mark.parametrize(
    ("name", "type_hash"),
    [("no name", ""), ("p/srv/S", ""), (3, ""), ("p/msg/T", "abc"), ("p/msg/T", None)],
)
def test_names_and_hashes_are_checked(name, type_hash):
    with pytest.raises(rosglass.InvalidNameError):
        OpaqueType(name, type_hash)
