"""Aliases in the types that DDS endpoints announce, one of the next (XTypes' TypeLookup)."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.errors import DefinitionError
from rosglass.interfaces import parse_type_description
from rosglass.wires.dds.type_lookup import describe_struct

if TYPE_CHECKING:
    from collections.abc import Callable

LIMIT = 16
UINT8 = SimpleNamespace(discriminator=13)
HEADER = SimpleNamespace(
    detail=SimpleNamespace(type_name="b::msg::dds_::Aliased_"),
    base_type=SimpleNamespace(discriminator=0),
)


def identifier(number: int) -> Any:
    return SimpleNamespace(discriminator=242, equivalence_hash=number.to_bytes(14, "big"))


def struct_of(kind: Any) -> Any:
    common = SimpleNamespace(member_flags=SimpleNamespace(IS_OPTIONAL=False), member_type_id=kind)
    member = SimpleNamespace(detail=SimpleNamespace(name="data"), common=common)
    flags = SimpleNamespace(IS_MUTABLE=False)
    struct = SimpleNamespace(header=HEADER, struct_flags=flags, member_seq=[member])
    return SimpleNamespace(discriminator=81, struct_type=struct)


def alias_of(kind: Any) -> Any:
    body = SimpleNamespace(common=SimpleNamespace(related_type=kind))
    return SimpleNamespace(discriminator=48, alias_type=SimpleNamespace(body=body))


class Peer:
    """Sends a struct, type 0, whose only field leads through aliases, types 1 to `count`."""

    def __init__(self, count: int, last: Any, wrap: Callable[[Any], Any] = lambda kind: kind):
        self.sent = 0
        self._objects = [struct_of(wrap(identifier(1)))]
        self._objects += [alias_of(identifier(at + 1)) for at in range(1, count)]
        self._objects.append(alias_of(last))

    def send(self, type_id: Any) -> Any:
        self.sent += 1
        return self._objects[int.from_bytes(type_id.equivalence_hash, "big")]

    def description(self) -> dict[str, Any]:
        return describe_struct(identifier(0), self.send)


def sequence(kind: Any) -> Any:
    return SimpleNamespace(
        discriminator=128, seq_sdefn=SimpleNamespace(element_identifier=kind, bound=0)
    )


@pytest.mark.parametrize("wrap", [lambda kind: kind, sequence], ids=["field", "element"])
def test_as_many_aliases_as_allowed_lead_to_a_type(wrap: Callable[[Any], Any]) -> None:
    found = parse_type_description(Peer(LIMIT, UINT8, wrap).description())
    assert [str(field.type) for field in found.fields] in (["uint8"], ["uint8[]"])


@pytest.mark.parametrize("wrap", [lambda kind: kind, sequence], ids=["field", "element"])
@pytest.mark.parametrize("count", [LIMIT + 1, 450])
def test_longer_chain_is_refused_by_name(count: int, wrap: Callable[[Any], Any]) -> None:
    peer = Peer(count, UINT8, wrap)
    with pytest.raises(DefinitionError, match="more than 16 aliases lead to its type") as caught:
        peer.description()
    assert "<b/msg/Aliased from TypeLookup>, field data" in str(caught.value)
    assert peer.sent <= LIMIT + 2  # the peer is not asked for the rest


@pytest.mark.parametrize("count", [1, 2, LIMIT, 450])
def test_cycle_of_aliases_is_refused_by_name(count: int) -> None:
    peer = Peer(count, identifier(1))
    with pytest.raises(DefinitionError, match="more than 16 aliases lead to its type") as caught:
        peer.description()
    assert "<b/msg/Aliased from TypeLookup>, field data" in str(caught.value)
    assert peer.sent <= LIMIT + 2


def test_alias_of_the_message_itself_is_refused() -> None:
    with pytest.raises(DefinitionError, match="alias cannot be a message"):
        describe_struct(identifier(1), Peer(1, UINT8).send)
