"""The library, which finds definitions in a chain of providers and caches them."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING

from rosglass.errors import (
    DefinitionConflictError,
    DefinitionError,
    InvalidNameError,
    TypeNotFoundError,
    UnsupportedError,
    close_matches,
)
from rosglass.interfaces.definition import Definition, ServiceDefinition, parts_of
from rosglass.interfaces.derived import compose, derive, derived_from
from rosglass.interfaces.hashes import announced_hashes, check_definition, md5, rihs01
from rosglass.interfaces.idl import parse_idl
from rosglass.interfaces.names import KINDS, adding_definitions, join_name, ros1_name, split_name
from rosglass.interfaces.parser import parse
from rosglass.interfaces.provider import (
    Distributions,
    Folders,
    MemoryProvider,
    Provider,
    difference,
    workspace,
    workspace_variables,
)
from rosglass.interfaces.resolver import Resolver

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rosglass.errors import Error
    from rosglass.interfaces.definition import Field, InterfaceDefinition, Source

__all__ = ["Library"]


class Versions:
    """Resolved ROS 2 definitions by name and RIHS01 hash.

    Versions of a type exist side by side: the hash that a peer announces selects one.
    The library's lock guards all methods.

    Args:
        find: Returns the definition of a message that types imply (times, identifiers) but
            descriptions omit; None if there is none.
    """

    def __init__(self, find: Callable[[str], InterfaceDefinition | None]) -> None:
        self._find = find
        self._known: dict[str, dict[str, InterfaceDefinition]] = {}

    def add(self, definition: InterfaceDefinition) -> str:
        """Store a resolved definition, and those it needs; returns its hash.

        Raises:
            UnsupportedError: It is a ROS 1 definition, or not a definition.
            DefinitionError: It is not resolved.
        """
        check_definition(definition)
        if definition.ros != 2:
            raise UnsupportedError(
                f"{definition.name} is a ROS 1 definition, which has no versions"
            )
        type_hash = rihs01(definition)
        for part in parts_of(definition):
            for nested in part.nested.values():
                self._put(nested, rihs01(nested))
        self._put(definition, type_hash)
        return type_hash

    def find(self, name: str, wanted: str = "") -> InterfaceDefinition | None:
        """Return a version of a type, or of a type derived from a known service or action.

        Args:
            name: Full type name.
            wanted: A hash announced for it; empty for the version added last.
        """
        known = self._known.get(name, {})
        found = known.get(wanted) if wanted else next(reversed(known.values()), None)
        if found is not None:
            return found
        for version in known.values():
            if isinstance(version, ServiceDefinition) and wanted in announced_hashes(version):
                return version
        for owner, suffix in derived_from(name, 2):
            for version in reversed(self._known.get(owner, {}).values()):
                derived = derive(version, suffix)
                if derived is None:
                    continue
                derived = self._resolver(version).resolve(derived)
                type_hash = rihs01(derived)
                if wanted in ("", type_hash):
                    return self._known.setdefault(name, {}).setdefault(type_hash, derived)
        return None

    def names(self) -> list[str]:
        """Return the full names of the stored types."""
        return list(self._known)

    def _put(self, definition: InterfaceDefinition, type_hash: str) -> None:
        known = self._known.setdefault(definition.name, {})
        # Keep the first object: types are made once per definition. It counts as added last.
        known[type_hash] = known.pop(type_hash, definition)

    def _resolver(self, owner: InterfaceDefinition) -> Resolver:
        nested = {
            name: inner for part in parts_of(owner) for name, inner in part.nested.items()
        } | {part.name: part for part in parts_of(owner)}

        def find(name: str, needs: Definition, field: Field) -> Definition:
            found = nested.get(name) or needs.nested.get(name) or self._find(name)
            if not isinstance(found, Definition):
                raise DefinitionError(
                    f"field {field.name} has the unknown type {name}", needs.source.file
                )
            return found

        return Resolver(find)


# pathlib takes longer to import than the first definition to load.
# ruff: noqa: PTH100, PTH111, PTH112


#: ROS 1's md5 sum for subscribers of any type.
ANY_HASH = "*"

#: Number of unknown types whose error is cached: finding similar names is slow.
_MAX_EXPLAINED = 1000

#: Environment variable with the names of preferred providers.
PREFER_VARIABLE = "ROSGLASS_PREFER_DEFINITIONS"


class Library:
    """Finds the definitions of types; thread-safe.

    A type is looked up in definitions received from peers, the sourced workspace, folders added by
    the user, and the distributions' standard sets, in this order. If it is not found, the
    environment is read again: it may name another workspace by then. If two of them define a type
    differently, neither is used unless one is preferred. Versions that peers sent on request are
    used last, and where their hash is requested.

    Args:
        providers: Replaces the workspace, the folders and the standard sets.
        distribution: The one whose standard set is searched first, e.g. ``humble``; by default the
            environment's ``ROS_DISTRO``, else Jazzy.
        prefer: Names of providers that win when definitions differ, see :meth:`prefer`; by
            default the environment's ``ROSGLASS_PREFER_DEFINITIONS`` (separated by commas).

    Raises:
        UnsupportedError: `distribution` or `prefer` is unknown.
    """

    def __init__(
        self, *providers: Provider, distribution: str = "", prefer: str | tuple[str, ...] = ()
    ) -> None:
        self._wire = MemoryProvider()
        self._folders = Folders()
        self._workspace, self._sourced = workspace(os.environ), workspace_variables(os.environ)
        standard = [self._workspace, self._folders, Distributions(distribution)]
        known = [self._wire.name, *(provider.name for provider in standard)]
        self._chain: list[Provider] = [self._wire, *(providers or standard)]
        self._lock = threading.RLock()
        self._loaded: dict[tuple[int, str, str], InterfaceDefinition] = {}
        self._resolvers: dict[int, Resolver] = {}
        self._explained: dict[tuple[str, int], str] = {}
        self._versions = Versions(lambda name: self._find(name, 2, self._chain, check=False))
        self._preferred: list[str] = []
        if prefer:
            self.prefer(*((prefer,) if isinstance(prefer, str) else prefer))
            return
        for name in reversed(os.environ.get(PREFER_VARIABLE, "").replace(",", " ").split()):
            if name not in known:
                raise UnsupportedError(
                    f"the environment's {PREFER_VARIABLE} has {name!r}; it takes: "
                    f"{', '.join(known)}"
                )
            if any(provider.name == name for provider in self._chain):
                self.prefer(name)

    def definition(self, name: str, ros: int = 2, *, hash: str = "") -> InterfaceDefinition:
        """Return the resolved definition of a type.

        Args:
            name: ``pkg/msg/Type``, ``pkg/srv/Type``, ``pkg/action/Type``; ``pkg/Type`` is the first
                message, service or action of that name. Types implied by services and actions have
                names too, e.g. ``pkg/srv/Type_Request``, ``pkg/action/Type_FeedbackMessage``; in
                ROS 1 ``pkg/TypeActionGoal``.
            ros: 1 or 2.
            hash: md5 sum (ROS 1) or RIHS01 hash (ROS 2) that a peer announced for it. Selects the
                definition with this hash, of any provider and distribution; ``*``, ROS 1's "any",
                counts as none. For a service, it may be the hash of its request, which ROS 2 nodes
                announce over DDS.

        Raises:
            InvalidNameError: `name` is not a type name.
            TypeNotFoundError: The type is unknown; the message lists the places searched.
            DefinitionConflictError: Two providers define the type, or one that it needs,
                differently, or no definition has `hash`.
            DefinitionError: A definition has an error or needs an unknown type.
        """
        if not isinstance(name, str):
            raise InvalidNameError(f"a type name is a str, got {name!r}")
        loaded = self._loaded.get((ros, name, hash))
        if loaded is None:
            _check_ros(ros)
            with self._lock:
                try:
                    loaded = self._look_up(name, ros, hash)
                except (TypeNotFoundError, DefinitionError, DefinitionConflictError):
                    if not self._read_workspace_again():
                        raise
                    loaded = self._look_up(name, ros, hash)
        return loaded

    def _look_up(self, name: str, ros: int, hash: str) -> InterfaceDefinition:
        if hash not in ("", ANY_HASH):
            loaded = self._matching(name, ros, hash)
        else:
            found = self._search(name, ros, self._resolver(ros), self._chain)
            if found is None:
                sent = self._version(name, ros)
                if sent is None:
                    raise self._unknown(name, ros)
                return sent  # not cached: a peer may send another
            # All spellings of a name share one object.
            loaded = self._loaded.setdefault((ros, found.name, ""), found)
        self._loaded[ros, name, hash] = loaded
        return loaded

    def _read_workspace_again(self) -> bool:
        """Replace the workspace if the environment has changed; return whether it has."""
        sourced = workspace_variables(os.environ)
        if sourced == self._sourced or self._workspace not in self._chain:
            return False
        found, self._sourced = workspace(os.environ), sourced
        self._chain[self._chain.index(self._workspace)] = found
        self._workspace = found
        # Never combine parts of both in one type.
        self._loaded.clear()
        self._resolvers.clear()
        self._explained.clear()
        return True

    def source(self, name: str, ros: int = 2) -> Source:
        """Return the origin of a type's definition; errors as in :meth:`definition`."""
        return self.definition(name, ros).source

    def names(self, ros: int = 2, kind: str | None = None) -> list[str]:
        """Return the full names of all known types, sorted.

        Args:
            ros: 1 or 2.
            kind: ``msg``, ``srv`` or ``action``; None for all.

        Raises:
            UnsupportedError: There is no such kind or version of ROS.
        """
        _check_ros(ros)
        if kind is not None and kind not in KINDS:
            raise UnsupportedError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
        with self._lock:
            names = {name for provider in self._chain for name in provider.names(ros)}
            names.update(self._versions.names() if ros == 2 else ())
        return sorted(name for name in names if kind is None or name.split("/")[1] == kind)

    def add_path(self, folder: str | os.PathLike[str]) -> None:
        """Add a folder: a package, a tree of packages, or an install or devel space.

        Types that are loaded already do not change.

        Raises:
            TypeNotFoundError: There is no such folder.
        """
        if not isinstance(folder, (str, os.PathLike)):
            raise TypeNotFoundError(f"a folder is given by its path, not by {folder!r:.80}")
        path = os.path.abspath(os.path.expanduser(folder))
        if not os.path.isdir(path):
            raise TypeNotFoundError(f"{path} is not a folder; no definitions can be read from it")
        with self._lock:
            if self._folders not in self._chain:
                self._chain.append(self._folders)
            self._folders.add(path)
            self._explained.clear()

    def add_text(
        self, name: str, text: str, ros: int = 2, source: str = "wire", *, encoding: str = ""
    ) -> InterfaceDefinition:
        """Add a definition that was received, e.g. from a ROS 1 connection header.

        Args:
            name: Its type name; ``pkg/Type`` means a message.
            text: The definition, optionally with those it needs after ``===`` lines.
            ros: 1 or 2.
            source: Its sender, for error messages, e.g. ``wire /camera/image``.
            encoding: ``idl`` for IDL; otherwise the kind in `name` decides.

        Returns:
            The definition, not resolved.

        Raises:
            DefinitionError: The text breaks a rule.
            DefinitionConflictError: It differs from that of another peer, or from the definition in
                use.
        """
        file = f"<{name} from {source}>"
        if encoding == "idl":
            definition = parse_idl(text, name, file=file, provider=source)
        elif encoding in ("", *KINDS):
            full = join_name(name, encoding or "msg")
            definition = parse(text, full, ros=ros, file=file, provider=source)
        else:
            raise UnsupportedError(
                f"{name}: definitions in the encoding {encoding!r} can't be read; known: "
                f"{', '.join(KINDS)}, idl"
            )
        self.add(definition)
        return definition

    def add(self, definition: InterfaceDefinition) -> None:
        """Add a parsed definition, and those in its ``nested``.

        Raises:
            DefinitionConflictError: As for :meth:`add_text`.
            UnsupportedError: `definition` is not an InterfaceDefinition.
        """
        check_definition(definition)
        with self._lock:
            self._explained.clear()
            for nested in _nested(definition).values():
                self._add_one(nested)
            self._add_one(definition)

    def add_version(self, definition: InterfaceDefinition) -> str:
        """Add a ROS 2 definition that a peer sent, to be found under its hash.

        Unlike with :meth:`add`, other definitions of the type do not conflict: this one is used if
        its hash is requested and, if no provider has the type, for its name alone (the version
        added last, if there are several).

        Args:
            definition: The definition, with all types that it needs in ``nested``.

        Returns:
            Its RIHS01 hash.

        Raises:
            UnsupportedError: It is a ROS 1 definition, or not a definition.
            DefinitionError: A type that it needs is missing.
        """
        with self._lock:
            self._explained.clear()
            return self._versions.add(definition)

    def version(self, name: str, hash: str = "") -> InterfaceDefinition | None:
        """Return a definition added by :meth:`add_version` for a name and hash (empty for any).

        Raises:
            InvalidNameError: `name` is not a type name.
        """
        with self._lock:
            return self._version(name, 2, hash)

    def prefer(self, *providers: str) -> None:
        """Prefer the definitions of these providers where providers differ, instead of an error.

        Args:
            providers: ``wire`` (received), ``workspace``, ``folders`` or ``distribution``; the
                first one wins over the others.

        Raises:
            UnsupportedError: There is no such provider.
        """
        known = [provider.name for provider in self._chain]
        for provider in providers:
            if provider not in known:
                raise UnsupportedError(
                    f"there is no provider {provider!r} to prefer; there are: {', '.join(known)}"
                )
        with self._lock:
            self._preferred = [*providers, *(p for p in self._preferred if p not in providers)]

    def _resolver(self, ros: int) -> Resolver:
        if ros not in self._resolvers:
            self._resolvers[ros] = self._new_resolver(ros, self._chain)
        return self._resolvers[ros]

    def _new_resolver(self, ros: int, chain: list[Provider], *, check: bool = True) -> Resolver:
        def find(name: str, owner: Definition, field: Field) -> Definition:
            found = self._find(name, ros, chain, check=check)
            if found is None:
                found = owner.nested.get(name)  # an IDL file may define several types
            if isinstance(found, Definition):
                return found
            raise DefinitionError(
                f"field {field.name} has the type {name}, which is unknown: "
                f"{self._not_found(name, ros)}",
                owner.source.file,
                *field.place,
            )

        return Resolver(find)

    def _load(
        self, name: str, ros: int, resolver: Resolver, chain: list[Provider], *, check: bool = True
    ) -> InterfaceDefinition:
        found = self._search(name, ros, resolver, chain, check=check)
        if found is None:
            raise self._unknown(name, ros)
        return found

    def _search(
        self, name: str, ros: int, resolver: Resolver, chain: list[Provider], *, check: bool = True
    ) -> InterfaceDefinition | None:
        for full in _full_names(name):
            found = self._find(full, ros, chain, check=check)
            if found is not None:
                return resolver.resolve(found)
        return None

    def _version(self, name: str, ros: int, wanted: str = "") -> InterfaceDefinition | None:
        """Return the definition that a peer sent with a hash, or the last one sent."""
        for full in _full_names(name) if ros == 2 else ():
            found = self._versions.find(full, wanted)
            if found is not None:
                return found
        return None

    def _unknown(self, name: str, ros: int) -> TypeNotFoundError:
        return TypeNotFoundError(
            f"no definition of {name} (ROS {ros}) was found: {self._not_found(name, ros)}"
        )

    def _find(
        self, name: str, ros: int, chain: list[Provider], *, check: bool
    ) -> InterfaceDefinition | None:
        """Return the unresolved definition of a full name, from a provider or derived."""
        found = self._choose(name, ros, chain, check=check)
        if found is not None:
            return found
        for owner_name, suffix in derived_from(name, ros):
            owner = self._choose(owner_name, ros, chain, check=check)
            derived = derive(owner, suffix) if owner is not None else None
            if derived is not None:
                return derived
        if ros == 1 and "/action/" in name:
            return compose(name, lambda part: self._choose(part, 1, chain, check=check))
        return None

    def _choose(
        self, name: str, ros: int, chain: list[Provider], *, check: bool
    ) -> InterfaceDefinition | None:
        """Return the first provider's definition; raises if that of another differs."""
        offers = [(provider, provider.find(name, ros)) for provider in chain]
        offers = [(provider, found) for provider, found in offers if found]
        if not offers:
            return None
        provider, (chosen, *_) = offers[0]
        if not check:
            return chosen
        for other, found in offers[1:]:
            differences = [difference(chosen, candidate) for candidate in found]
            if all(differences):
                winner = self._winner(offers)
                if winner is not None:
                    return winner
                one, two = _place(provider, chosen), _place(other, found[0])
                raise DefinitionConflictError(
                    f"two sources define {name} differently: {one} and {two}: {differences[0]}. "
                    f"Remove one, or choose: Library.prefer({provider.name!r}) or "
                    f"Library.prefer({other.name!r}), or set {PREFER_VARIABLE}={provider.name}"
                )
        return chosen

    def _winner(
        self, offers: list[tuple[Provider, Sequence[InterfaceDefinition]]]
    ) -> InterfaceDefinition | None:
        for name in self._preferred:
            for provider, found in offers:
                if provider.name == name:
                    return found[0]
        return None

    def _matching(self, name: str, ros: int, wanted: str) -> InterfaceDefinition:
        """Return the definition with a hash, of any provider or distribution."""
        sent = self._version(name, ros, wanted)
        if sent is not None:
            return sent
        tried: dict[str, str] = {}
        problem: Error | None = None
        for resolver, chain, check in self._views(ros):
            try:
                found = self._load(name, ros, resolver, chain, check=check)
            except (DefinitionError, DefinitionConflictError) as error:
                problem = problem or error
                continue
            hashes = (md5(found),) if ros == 1 else announced_hashes(found)
            if wanted in hashes:
                # If the usual definition is the requested one, return the same object.
                return self._loaded.setdefault((ros, found.name, ""), found) if check else found
            tried.setdefault(hashes[0], _place(None, found))
        if problem is not None and not tried:
            raise problem
        known = "; ".join(f"{place} has {actual}" for actual, place in tried.items())
        raise DefinitionConflictError(
            f"no definition of {name} has the hash {wanted} that the peer announces: {known}. "
            f"Source the peer's workspace, or {adding_definitions(name, ros)}"
        )

    def _views(self, ros: int) -> Iterator[tuple[Resolver, list[Provider], bool]]:
        """Yield the chain, then the chain with each provider and distribution moved to the front.

        Each has a resolver, and a flag whether differing definitions are an error.
        """
        yield self._resolver(ros), self._chain, True
        for provider in self._chain:
            for view in provider.views(ros):
                chain = [view, *(other for other in self._chain if other is not provider)]
                yield self._new_resolver(ros, chain, check=False), chain, False

    def _add_one(self, definition: InterfaceDefinition) -> None:
        key = (definition.ros, definition.name, "")
        used = self._loaded.get(key) or self._resolver(definition.ros).known(definition.name)
        found = difference(used, definition) if used is not None else ""
        if found and self._preferred[:1] != [self._wire.name]:
            assert used is not None
            raise DefinitionConflictError(
                f"{definition.name} as received from {definition.source.provider} differs from "
                f"the definition in use, from {_place(None, used)}: {found}. Use "
                "Library.prefer('wire') to trust what peers send"
            )
        if found:
            self._wire.replace(definition)
            self._loaded.clear()
            self._resolvers.clear()
        else:
            self._wire.add(definition)

    def _not_found(self, name: str, ros: int) -> str:
        """Create the error for an unknown type, cached until something is added."""
        text = self._explained.get((name, ros))
        if text is None:
            if len(self._explained) >= _MAX_EXPLAINED:
                self._explained.clear()
            text = self._explained[name, ros] = self._explain(name, ros)
        return text

    def _explain(self, name: str, ros: int) -> str:
        looked = [text for text in (p.describe(ros) for p in self._chain) if text]
        names = self.names(ros)
        other = self.names(3 - ros)
        short = {f"{n.split('/')[0]}/{n.split('/')[2]}".lower(): n for n in reversed(names)}
        wanted = "/".join(part for part in name.split("/") if part not in KINDS)
        near = close_matches(wanted.lower(), short, 3, 0.75)
        # Types with a long package name in common are not similar for that.
        base = wanted.rpartition("/")[2].lower()
        near = [m for m in near if close_matches(base, [m.rpartition("/")[2]], 1, 0.6)]
        if near[:1] == [wanted.lower()]:
            del near[1:]  # only the case is wrong
        close = [short[match] for match in near]
        if ros == 1 and name.count("/") == 1:
            # Spelled as in ROS 1 and in the request.
            close = [ros1_name(match) for match in close]
        text = f"looked in {'; '.join(looked) or 'nothing: there are no providers'}."
        if close:
            text += f" Did you mean {' or '.join(close)}?"
        if any(n.split("/")[0] + "/" + n.split("/")[2] == wanted for n in other):
            text += f" ROS {3 - ros} has it."
        return f"{text} Source its workspace, or {adding_definitions(name, ros)}"


def _full_names(name: str) -> list[str]:
    package, kind, base = split_name(name)
    return [f"{package}/{candidate}/{base}" for candidate in ((kind,) if kind else KINDS)]


def _check_ros(ros: int) -> None:
    if ros not in (1, 2):
        raise UnsupportedError(f"ros must be 1 or 2, got {ros!r}")


def _place(provider: Provider | None, definition: InterfaceDefinition) -> str:
    label = definition.source.provider
    file = definition.source.file
    if provider is not None and not label.startswith(provider.name):
        label = f"{provider.name} {label}"
    return label if file.startswith("<") else f"{label} ({file})"


def _nested(definition: InterfaceDefinition) -> dict[str, Definition]:
    return {name: inner for part in parts_of(definition) for name, inner in part.nested.items()}
