from __future__ import annotations

import random

import pytest

from rosglass.comm import NodeName
from rosglass.errors import DecodeError
from rosglass.wires.dds.graph import (
    NodeEntities,
    ParticipantEntities,
    format_user_data,
    hash_of,
    parse_user_data,
)


def gid(number: int) -> bytes:
    return bytes([1, 16]) + number.to_bytes(14, "big")


INFO = ParticipantEntities(
    gid(0x1C1),
    (
        NodeEntities(NodeName("/", "talker"), (gid(1), gid(2)), (gid(3),)),
        NodeEntities(NodeName("/arm/left", "gripper"), (), ()),
        NodeEntities(NodeName("/", "odd"), (), (gid(4),)),
    ),
)
EMPTY = ParticipantEntities(gid(0x1C1))


def widths(info: ParticipantEntities) -> list[ParticipantEntities]:
    return [info, ParticipantEntities(info.gid, info.nodes, humble=True)]


@pytest.mark.parametrize("info", widths(INFO) + widths(EMPTY))
@pytest.mark.parametrize("padding", [b"", b"\0", b"\0\0\0"])
def test_sample_survives_a_round_trip_in_both_gid_widths(info, padding):
    assert ParticipantEntities.decode(info.encode() + padding) == info


@pytest.mark.parametrize("info", widths(INFO) + widths(EMPTY))
def test_bytes_are_those_of_rosbags(info):
    stores = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed")
    np = pytest.importorskip("numpy")
    store = stores.get_typestore(
        stores.Stores.ROS2_HUMBLE if info.humble else stores.Stores.ROS2_JAZZY
    )
    types, width = store.types, 24 if info.humble else 16

    def peer_gid(value):
        data = np.frombuffer(value.ljust(width, b"\0"), np.uint8)
        return types["rmw_dds_common/msg/Gid"](data)

    nodes = [
        types["rmw_dds_common/msg/NodeEntitiesInfo"](
            entities.node.namespace,
            entities.node.name,
            [peer_gid(value) for value in entities.readers],
            [peer_gid(value) for value in entities.writers],
        )
        for entities in info.nodes
    ]
    name = "rmw_dds_common/msg/ParticipantEntitiesInfo"
    message = types[name](peer_gid(info.gid), nodes)
    assert info.encode() == bytes(store.serialize_cdr(message, name))
    assert (
        ParticipantEntities.decode(bytes(store.serialize_cdr(message, name, little_endian=False)))
        == info
    )


@pytest.mark.parametrize("info", widths(INFO))
def test_cut_samples_are_refused(info):
    data = info.encode()
    # The first 24 bytes of the wide form happen to be a whole sample of the other, without nodes.
    whole = range(24, 28) if info.humble else ()
    for end in set(range(len(data))) - set(whole):
        with pytest.raises(DecodeError):
            ParticipantEntities.decode(data[:end])
    assert all(ParticipantEntities.decode(data[:end]) == EMPTY for end in whole)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "no plain CDR (header missing)"),
        (b"\x00\x07\0\0" + bytes(20), "no plain CDR (header 00 07 00 00)"),
        (b"\x00\x01\0\0" + bytes(16) + b"\xff\xff\xff\xff", "4294967295 items in too few bytes"),
        (EMPTY.encode() + bytes(500), "bytes left over"),
        (
            ParticipantEntities(gid(1), (NodeEntities(NodeName("/", "n" * 300)),)).encode(),
            "a name of 301 bytes",
        ),
        (
            ParticipantEntities(gid(1), (NodeEntities(NodeName("/", "é")),)).encode(),
            "is not an ASCII name",
        ),
    ],
)
def test_malformed_sample_is_rejected_with_the_reason(data, reason):
    with pytest.raises(DecodeError) as error:
        ParticipantEntities.decode(data)
    assert reason in str(error.value)


def test_rubbish_raises_nothing_but_decode_errors():
    dice = random.Random(7)
    good = [info.encode() for info in widths(INFO)]
    refused = 0
    for _ in range(3000):
        data = bytearray(dice.choice(good))
        for _ in range(dice.randint(1, 6)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        try:
            ParticipantEntities.decode(data[: dice.randint(0, len(data))])
        except DecodeError:
            refused += 1
    assert refused > 1000


HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


@pytest.mark.parametrize(
    ("data", "pairs"),
    [
        (b"enclave=/;", {"enclave": "/"}),
        (f"typehash={HASH};".encode(), {"typehash": HASH}),
        (
            b"serviceid= 1.10.2a.0;typehash=RIHS01_ab;",
            {"serviceid": " 1.10.2a.0", "typehash": "RIHS01_ab"},
        ),
        (b"", {}),
        (b"no pairs at all", {}),
        (b"=x;;a=;b", {"a": ""}),
        (b"\xff=1;a=\xff;a=2;", {"a": "\N{REPLACEMENT CHARACTER}"}),
    ],
)
def test_user_data(data, pairs):
    assert parse_user_data(data) == pairs


def test_user_data_is_written_as_it_is_read():
    pairs = {"clientid": "1.10.2", "typehash": HASH}
    assert parse_user_data(format_user_data(pairs)) == pairs
    assert format_user_data({"typehash": ""}) == b""
    assert hash_of(f"typehash={HASH};".encode()) == HASH
    assert hash_of(b"\0\1\2") == ""
