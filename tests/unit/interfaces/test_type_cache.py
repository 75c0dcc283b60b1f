"""Types that robots sent are kept on disk, and used only if their hash fits."""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from rosglass.interfaces import (
    Definition,
    Library,
    ServiceDefinition,
    TypeCache,
    add_type_sources,
    announced_hashes,
    cache_folder,
    parse_type_description,
    rihs01,
    type_description,
    type_sources,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.interfaces import InterfaceDefinition

NAME = "my_msgs/msg/State"
TEXT = "# What it does.\nuint8 IDLE=0 # nothing\nuint8 state 3 # [V]\nmy_msgs/Part[] parts\n"


def sent(name: str = NAME, text: str = TEXT) -> InterfaceDefinition:
    library = Library()
    library.add_text("my_msgs/msg/Part", "int8 a")
    library.add_text(name, text)
    definition = library.definition(name)
    described = parse_type_description(type_description(definition), provider="wire /talker")
    return add_type_sources(described, type_sources(definition), verbatim=True)


@pytest.fixture
def cache(tmp_path: Path) -> TypeCache:
    return TypeCache(str(tmp_path / "not" / "there" / "yet"))


def only_file(cache: TypeCache) -> Path:
    (path,) = Path(cache.folder).iterdir()
    return path


def test_keeps_everything(cache: TypeCache) -> None:
    definition = sent()
    assert cache.get(NAME, rihs01(definition)) is None
    cache.put(definition, rihs01(definition))
    found = TypeCache(cache.folder).get(NAME, rihs01(definition))
    assert isinstance(found, Definition)
    assert rihs01(found) == rihs01(definition)
    assert (found.fields, found.constants) == (definition.fields, definition.constants)
    assert found.text == TEXT.rstrip("\n") or found.text == TEXT
    assert found.source.provider == "cache, from /talker"
    assert only_file(cache).name == f"{rihs01(definition)}.json"


def test_services_under_each_of_their_hashes(cache: TypeCache) -> None:
    definition = sent("my_msgs/srv/Ask", "string question\n---\nmy_msgs/Part answer")
    assert isinstance(definition, ServiceDefinition)
    own, request, response = announced_hashes(definition)
    assert own == rihs01(definition)
    for announced in (own, request, response):
        cache.put(definition, announced)
        found = cache.get("my_msgs/srv/Ask", announced)
        assert isinstance(found, ServiceDefinition)
        assert rihs01(found) == own


def spoil(change: Callable[[Any], None]) -> Callable[[str], str]:
    def spoiled(text: str) -> str:
        entry = json.loads(text)
        change(entry)
        return json.dumps(entry)

    return spoiled


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "",
        lambda text: text[: len(text) // 2],
        lambda text: "[" * 100_000,
        lambda text: "null",
        lambda text: "\udc80",
        spoil(lambda entry: entry.pop("source")),
        spoil(lambda entry: entry.update(source=3)),
        spoil(lambda entry: entry.update(type_sources=None)),
        spoil(lambda entry: entry.update(type_sources=[3])),
        spoil(lambda entry: entry["type_description"]["type_description"]["fields"].pop()),
        spoil(
            lambda entry: entry["type_description"]["type_description"].update(
                type_name="my_msgs/msg/Other"
            )
        ),
    ],
)
def test_entry_with_another_hash_is_discarded(
    cache: TypeCache, change: Callable[[str], str]
) -> None:
    definition = sent()
    cache.put(definition, rihs01(definition))
    path = only_file(cache)
    path.write_bytes(change(path.read_text()).encode(errors="surrogateescape"))
    assert cache.get(NAME, rihs01(definition)) is None
    cache.put(definition, rihs01(definition))
    assert cache.get(NAME, rihs01(definition)) is not None


def test_another_name_with_the_same_hash_is_not_it(cache: TypeCache) -> None:
    definition = sent()
    cache.put(definition, rihs01(definition))
    assert cache.get("my_msgs/msg/Other", rihs01(definition)) is None


@pytest.mark.parametrize("odd", ["", "*", "../../x", "RIHS01_12", "RIHS01_" + "/" * 64])
def test_only_hashes_name_files(cache: TypeCache, odd: str) -> None:
    cache.put(sent(), odd)
    assert cache.get(NAME, odd) is None
    assert not Path(cache.folder).exists()


def test_switched_off(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("ROSGLASS_TYPE_CACHE", "off")
    assert cache_folder() == ""
    cache = TypeCache(cache_folder())
    definition = sent()
    cache.put(definition, rihs01(definition))
    assert cache.get(NAME, rihs01(definition)) is None
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("platform", "environment", "expected"),
    [
        ("linux", {}, "{home}/.cache/rosglass/types"),
        ("linux", {"XDG_CACHE_HOME": "/big/disk"}, "/big/disk/rosglass/types"),
        ("linux", {"XDG_CACHE_HOME": "relative"}, "{home}/.cache/rosglass/types"),
        ("darwin", {"XDG_CACHE_HOME": "/x"}, "{home}/Library/Caches/rosglass/types"),
        ("win32", {"LOCALAPPDATA": "/local"}, "/local/rosglass/types"),
        ("linux", {"ROSGLASS_TYPE_CACHE": "~/types"}, "{home}/types"),
        ("linux", {"ROSGLASS_TYPE_CACHE": "OFF"}, ""),
    ],
)
def test_folder_follows_platform_and_environment(
    platform: str,
    environment: dict[str, str],
    expected: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(sys, "platform", platform)
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "ROSGLASS_TYPE_CACHE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"HOME": str(tmp_path), **environment}.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == expected.format(home=tmp_path)


@pytest.mark.parametrize("kind", ["a file", "forbidden"])
def test_unwritable_folder_is_not_an_error(kind: str, tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    if kind == "a file":
        folder.write_text("")
    else:
        folder = tmp_path / "\0"
    cache = TypeCache(str(folder))
    definition = sent()
    cache.put(definition, rihs01(definition))
    cache.put(definition, rihs01(definition))
    assert cache.get(NAME, rihs01(definition)) is None


def test_old_entries_make_room(cache: TypeCache, monkeypatch: pytest.MonkeyPatch) -> None:
    definitions = [sent(text=f"uint8[{n + 1}] state") for n in range(6)]
    cache.put(definitions[0], rihs01(definitions[0]))
    size = only_file(cache).stat().st_size
    monkeypatch.setattr("rosglass.interfaces.type_descriptions._MAX_TOTAL", int(size * 3.5))
    for age, definition in enumerate(definitions):
        cache.put(definition, rihs01(definition))
        path = Path(cache.folder, f"{rihs01(definition)}.json")
        os.utime(path, (1000 + age, 1000 + age))
    kept = [cache.get(NAME, rihs01(definition)) is not None for definition in definitions]
    assert kept == [False, False, False, True, True, True]


def test_many_writers_at_once(cache: TypeCache) -> None:
    definitions = [sent(text=f"uint8[{n + 1}] state") for n in range(4)]

    def write() -> None:
        for definition in definitions * 5:
            cache.put(definition, rihs01(definition))
            assert cache.get(NAME, rihs01(definition)) is not None

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(list(Path(cache.folder).iterdir())) == len(definitions)
