from __future__ import annotations

import pytest

from rosglass import Duration, QoS
from rosglass.comm import (
    EndpointInfo,
    EndpointKind,
    History,
    Liveliness,
    NodeName,
)
from rosglass.wires.zenoh.keys import (
    NO_ATTACHMENT,
    Attachment,
    Token,
    decode_qos,
    encode_qos,
    gid_of,
    graph_key,
    topic_key,
)

HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
STRING = "std_msgs/msg/String"
SESSION = "414012bb60880a3835b007fe951eb92a"
# Written by zenoh-ros2-sdk 0.1.8.
SEEN = (
    f"@ros2_lv/0/{SESSION}/0/0/MP/%/%/zenoh_publisher_5790ee48/%chatter/"
    f"std_msgs::msg::dds_::String_/{HASH}/::,10:,:,:,,"
)


def endpoint(kind=EndpointKind.PUBLISHER, name="/chatter", qos=QoS(), type_hash=HASH):  # noqa: B008
    return EndpointInfo(kind, name, STRING, NodeName("/arm/left", "talker"), qos, type_hash)


def test_data_keys():
    assert (
        topic_key(0, "/chatter", STRING, HASH) == f"0/chatter/std_msgs::msg::dds_::String_/{HASH}"
    )
    assert topic_key(7, "/a/b", STRING, "*") == "7/a/b/std_msgs::msg::dds_::String_/*"
    assert graph_key(7) == "@ros2_lv/7/**"


def test_node_token():
    token = Token(3, "ab12", "0", "0", NodeName("/arm/left", "talker"))
    assert token.key() == "@ros2_lv/3/ab12/0/0/NN/%/%arm%left/talker"
    assert Token.parse(token.key()) == token
    root = Token(3, "ab12", "0", "0", NodeName("/", "talker"))
    assert root.key() == "@ros2_lv/3/ab12/0/0/NN/%/%/talker"
    assert Token.parse(root.key()) == root


def test_publisher_token_written_by_a_peer():
    token = Token.parse(SEEN)
    assert token.domain == 0
    assert token.session == SESSION
    assert token.node == NodeName("/", "zenoh_publisher_5790ee48")
    found = token.endpoint
    assert found is not None
    assert (found.kind, found.name, found.type) == (EndpointKind.PUBLISHER, "/chatter", STRING)
    assert found.type_hash == HASH
    assert found.qos == QoS(depth=10)
    assert found.gid == gid_of(SEEN)


@pytest.mark.parametrize("kind", list(EndpointKind))
def test_endpoint_tokens_come_back_as_they_were(kind):
    written = Token(0, "ab12", "0", "5", endpoint().node, endpoint(kind, "/a/b"))
    read = Token.parse(written.key())
    assert read.node == written.node
    assert read.endpoint is not None
    assert (read.endpoint.kind, read.endpoint.name) == (kind, "/a/b")
    assert (read.endpoint.type, read.endpoint.type_hash) == (STRING, HASH)


def test_humble_has_no_hash():
    key = Token(0, "ab12", "0", "1", endpoint().node, endpoint(type_hash="")).key()
    assert "/TypeHashNotSupported/" in key
    assert Token.parse(key).endpoint.type_hash == ""


@pytest.mark.parametrize(
    ("change", "attribute", "expected"),
    [
        (lambda k: k + "/buffer", "name", "/chatter"),
        (lambda k: k.replace("%chatter", "chatter"), "name", "/chatter"),
        (lambda k: k.replace("std_msgs::msg::dds_::String_", "Foreign"), "type", "Foreign"),
        (lambda k: k.replace("::,10:", "4:5:0,0:"), "qos", QoS(depth=1)),
        (lambda k: k.replace("/0/0/MP", "/name_of_node/5/MP"), "name", "/chatter"),
    ],
    ids=["a 14th part", "no leading slash", "foreign type", "unknown policies", "text as id"],
)
def test_tokens_of_other_programs_and_versions_are_understood(change, attribute, expected):
    assert getattr(Token.parse(change(SEEN)).endpoint, attribute) == expected


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("", "at least 9 parts"),
        ("0/chatter/x", "at least 9 parts"),
        ("other/0/a/0/0/NN/%/%/n", "beginning with @ros2_lv"),
        ("@ros2_lv/x/a/0/0/NN/%/%/n", "invalid literal"),
        ("@ros2_lv/0/a/0/0/XX/%/%/n", "unknown kind of entity 'XX'"),
        ("@ros2_lv/0/a/0/0/MP/%/%/n/%t/T/H", "at least 13 parts"),
        (SEEN.replace("::,10:,:,:,,", "1:2"), "expected 6 QoS fields"),
        (SEEN.replace(",10:", ",ten:"), "invalid literal"),
    ],
)
def test_malformed_tokens_are_refused(key, message):
    with pytest.raises(ValueError, match=message):
        Token.parse(key)


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (QoS(), "::,10:,:,:,,"),
        (QoS.latched(), ":1:,1:,:,:,,"),
        (QoS.sensor_data(), "2::,5:,:,:,,"),
        (QoS(history=History.KEEP_ALL), "::2,10:,:,:,,"),
        (QoS(deadline=Duration(1_500_000_000)), "::,10:1,500000000:,:,,"),
        (QoS(lifespan=Duration(2)), "::,10:,:0,2:,,"),
        (
            QoS(liveliness=Liveliness.MANUAL_BY_TOPIC, lease_duration=Duration(3_000_000_000)),
            "::,10:,:,:3,3,0",
        ),
    ],
)
def test_quality_of_service_in_tokens(qos, text):
    assert encode_qos(qos) == text
    assert decode_qos(text) == qos


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("::,10:,:,:,,", QoS()),
        (":1:,1:,:,:,,", QoS.latched()),
        ("2::,5:,:,:,,", QoS.sensor_data()),
        (":::,:,:,,", QoS(depth=42)),
        ("::2,0:,:,:,,", QoS(depth=1, history=History.KEEP_ALL)),
        ("::,10:9223372036,854775807:18446744073,709551615:,,", QoS()),
        ("::,10:0,0:,:,,:more", QoS()),
    ],
)
def test_empty_fields_mean_rmw_zenohs_defaults_and_huge_times_mean_none(text, expected):
    assert decode_qos(text) == expected


def test_attachments():
    note = Attachment(7, 1_700_000_000_123_456_789, bytes(range(16)))
    data = note.encode()
    assert len(data) == 33
    assert data[:8] == (7).to_bytes(8, "little")
    assert data[16] == 16
    assert Attachment.decode(data) == note


@pytest.mark.parametrize("data", [b"", b"x" * 33, bytes(32), bytes(34), b"sequence_number"])
def test_foreign_attachments_are_ignored(data):
    assert Attachment.decode(data) == NO_ATTACHMENT


def test_identities_are_stable_and_16_bytes_low_half_first():
    # xxhash's own test vector for the empty input: 99AA06D3014798D86001C324468D497F.
    assert gid_of("").hex() == bytes.fromhex("99aa06d3014798d86001c324468d497f")[::-1].hex()
