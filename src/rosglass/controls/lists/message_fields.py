"""The element ``MessageFields``: a message of any type to fill in, as the rows of a form."""
# ruff: noqa: N802, N815 - the names of slots and signals are QML's

from __future__ import annotations

import json
import re
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, Any

import rosglass
from rosglass.controls.lists.field_hints import choices_of, range_of
from rosglass.controls.lists.field_tree import FieldTree, entered_value, fits_line, value_text
from rosglass.controls.lists.message_store import MessageStore, Stored, run_later
from rosglass.controls.lists.texts import bounded
from rosglass.errors import ConversionError, Error, InvalidNameError, TypeNotFoundError
from rosglass.qml.elements.element import RETRY_MS, Element, single_shot
from rosglass.qml.elements.message_item_model import check_leaf, default_element, plain_tree
from rosglass.qml.engine.from_js import fields_from_js
from rosglass.qml.engine.properties import ReadOnly, Writable, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QJSValue, QtCore, Signal, Slot, is_alive

if TYPE_CHECKING:
    from collections.abc import Callable

    from rosglass.controls.lists.field_tree import FieldRow
    from rosglass.messages import MessageType
    from rosglass.messages.schema import Schema
    from rosglass.qml.elements.message_item_model import TreeItem

__all__ = ["MessageFields"]

_ROLES = ("key", "name", "depth", "folds", "open", "kind", "type", "text", "checked", "unit",
          "comment", "range", "isOutside", "choices", "problem", "canInsert", "canRemove",
          "canRise", "canSink")  # fmt: skip
#: Fields of a type that are all unfolded at first, and rows that a form shows at most.
_MAX_UNFOLDED, _MAX_ROWS = 40, 400
#: Characters of JSON that a form reads.
_MAX_JSON = 100_000
_NOW = "now"


class _Now(dict[str, int]):
    """A time that is replaced by the current one when the message is taken from the form."""


class MessageFields(Element):
    """The fields of a new message as the rows of a form. See its page in ``docs/controls``."""

    #: A field was changed, by hand or by :meth:`load`.
    messageChanged = Signal()
    keptChanged = Signal()

    #: Type: of a message, of a service (its request is filled in), or of an action (its goal).
    type = Writable(str, "")
    #: The rows, for a view.
    rows = ReadOnly(QtCore.QObject, read=lambda self: self._tree.model)
    #: Whether the type is known.
    ready = ReadOnly(bool, False)
    #: Full name of the message's own type.
    messageType = ReadOnly(str, "")
    #: The comment of the message's definition.
    comment = ReadOnly(str, "")
    #: Why there is no message now, or rows were not unfolded; empty for no reason.
    refusal = ReadOnly(str, "")
    #: Whether every text that was entered fits its field.
    valid = ReadOnly(bool, False)
    #: Sent messages in one line each, the last one first; and names of favourites.
    history: Any = ReadOnly("QStringList", (), notify="keptChanged", read="_get_history")  # type: ignore[arg-type]
    favourites: Any = ReadOnly("QStringList", (), notify="keptChanged", read="_get_favourites")  # type: ignore[arg-type]
    #: Why sent messages or favourites are not kept; empty for no reason.
    keepProblem = ReadOnly(str, "")

    _HOLDS = ("_tree", "_kind", "_wrong", "_kept")
    _type: str

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._tree = FieldTree(self, _ROLES, self._read, self._folds)
        self._kind: MessageType | None = None
        #: Texts that do not fit, with the reason, by key.
        self._wrong: dict[str, tuple[str, str]] = {}
        self._kept = Stored()
        self._loading: tuple[Any, ...] | None = None
        #: Fields to show as soon as the type is known.
        self._waiting: dict[str, Any] | None = None
        self._again = single_shot(self, self._load_again)

    # -- the type --------------------------------------------------------------------------------

    def _update(self) -> None:
        super()._update()
        wanted = (self._type, self.node)
        if wanted == self._loading:
            return
        # The form of the same type is kept when the robot is changed.
        if self._loading is None or wanted[0] != self._loading[0]:
            self._forget()
        self._loading = wanted
        if self._type and self._kind is None:
            self._load_again()

    def _forget(self) -> None:
        self._kind, self._kept, self._waiting = None, Stored(), None
        self._wrong.clear()
        self._tree.open.clear()
        self._tree.clear()
        self._set_problem("")
        report(self, ready=False, messageType="", comment="", refusal="", valid=False)
        self.keptChanged.emit()
        self.messageChanged.emit()

    @Slot()
    def _load_again(self) -> None:
        name, session = self._type, self._session
        if not name or session is None:
            return
        show = weak_callback(self._on_loaded)
        session.background(lambda: _load(name), lambda result: show(name, result))

    def _on_loaded(self, name: str, result: MessageType | Error) -> None:
        if not is_alive(self) or name != self._type or self._kind is not None:
            return
        if isinstance(result, TypeNotFoundError):
            self._set_problem(
                f"{name}: the type is not known here, and is requested from the robot"
            )
            self._fetch(name)
        elif isinstance(result, Error):
            self._set_problem(f"{name}: {result}")
        else:
            self._start(result)

    def _fetch(self, name: str) -> None:
        """Request a type without a local definition from the robot, until it is received."""
        node, again = self.node, weak_callback(self._again.start)
        try:
            if node is not None:
                promise = node.fetch_type_async(name)
                promise.on_done(lambda _: again(RETRY_MS), self._executor)
                return
        except Error:
            pass  # asked again
        self._again.start(RETRY_MS)

    def _start(self, kind: MessageType) -> None:
        self._kind = kind
        self._set_problem("")
        schema = kind.create()._schema__
        comment = bounded(kind.definition.comment, 2000, lines=True)
        report(self, ready=True, messageType=kind.name, comment=comment)
        self._tree.open.update(_unfolded(schema))
        waiting, self._waiting = self._waiting, None
        self.clear()
        if waiting is not None:
            self._show(waiting)
        self._keep(MessageStore(kind.name).read)

    # -- the rows --------------------------------------------------------------------------------

    @staticmethod
    def _folds(row: FieldRow) -> bool:
        return row.folds and not _is_time(row.item)

    def _read(self, row: FieldRow, role: str) -> Any:
        item, member = row.item, row.item.member
        assert member is not None
        if role in ("name", "depth", "open"):
            return getattr(row, role)
        if role == "folds":
            return self._folds(row)
        if role == "kind":
            return _kind_of(row)
        if role == "type":
            return str(member.field.type) if item.is_array else member.field.type.name
        if role in ("text", "problem"):
            wrong = self._wrong.get(row.key)
            if wrong is not None:
                return wrong[role == "problem"]
            return _entered(item) if role == "text" and row.span is None else ""
        if role == "checked":
            return item.is_leaf and item.value is True
        if role == "unit":
            return member.field.unit
        if role == "comment":
            comment = " ".join(member.field.comment.split())
            return bounded(comment, 300) if comment != f"[{member.field.unit}]" else ""
        if role in ("canInsert", "canRemove", "canRise", "canSink"):
            return _can(row, role)
        if role == "choices":
            return self._choices(item)
        limits = range_of(member.field.comment) if member.number is not None else None
        if limits is None or not item.is_leaf:
            return "" if role == "range" else False
        if role == "range":
            return f"{limits[0]:.6g} … {limits[1]:.6g}"
        return not limits[0] <= item.value <= limits[1]

    def _choices(self, item: TreeItem) -> list[dict[str, str]]:
        owner = item.parent.parent if item.is_element and item.parent else item.parent
        if not item.is_leaf or owner is None or owner.schema is None or item.member is None:
            return []
        found = choices_of(owner.schema.definition, item.member.field)
        return [{"text": one.name, "value": one.text, "comment": one.comment} for one in found]

    # -- changes by the form ---------------------------------------------------------------------

    @Slot(str)
    def toggle(self, key: str) -> None:
        """Fold or unfold a row."""
        before = set(self._tree.open)
        refusal = self._tree.toggle(key)
        if not refusal and len(self._tree.model.keys) > _MAX_ROWS and key not in before:
            self._tree.toggle(key)
            refusal = f"{key} has too many rows for a form: fold others first"
        report(self, refusal=refusal)

    @Slot(str, str, result=bool)
    def setText(self, key: str, text: str) -> bool:
        """Set a number, text or time to what was entered; a number also by the name of a constant.

        A text that does not fit stays in its row, which says why, and there is no message until it
        is corrected.
        """
        row = self._tree.row(key)
        if row is None or row.span is not None or not (row.item.is_leaf or _is_time(row.item)):
            return False
        item = row.item
        named = {one["text"]: one["value"] for one in self._choices(item)}
        text = named.get(text.strip(), text)
        try:
            if item.is_leaf:
                item.set(entered_value(text, item))
            else:
                _set_value(item, _time_of(text, item))
        except ConversionError as error:
            self._wrong[key] = text, str(error)
            self._changed(key)
            return False
        self._wrong.pop(key, None)
        self._changed(key)
        return True

    @Slot(str, result=bool)
    def insert(self, key: str) -> bool:
        """Add an element to the end of an array, or behind one of its elements."""
        row = self._tree.row(key)
        if row is None or not _can(row, "canInsert"):
            return False
        array = row.item if row.item.is_array else row.item.parent
        assert array is not None
        at = array.count if row.item.is_array else row.item.row + 1
        self._end_edit(array)
        array.insert(at, [default_element(array)])
        self._tree.open.add(array.path)
        self._rebuild()
        return True

    @Slot(str, result=bool)
    def remove(self, key: str) -> bool:
        """Remove an element of an array."""
        row = self._tree.row(key)
        if row is None or not _can(row, "canRemove"):
            return False
        array = row.item.parent
        assert array is not None
        self._end_edit(array)
        array.remove(row.item.row, 1)
        self._rebuild()
        return True

    @Slot(str, int, result=bool)
    def move(self, key: str, by: int) -> bool:
        """Move an element of an array up (-1) or down (1)."""
        row = self._tree.row(key)
        if row is None or not _can(row, "canRise" if by < 0 else "canSink"):
            return False
        array, at = row.item.parent, row.item.row
        assert array is not None
        goal = at - 1 if by < 0 else at + 1
        self._end_edit(array)
        value = array.value[at]
        array.remove(at, 1)
        array.insert(goal, [value])
        self._rebuild()
        return True

    @Slot()
    def clear(self) -> None:
        """Give all fields their defaults."""
        if self._kind is not None:
            self._set_tree(plain_tree(self._kind.create()))

    def _end_edit(self, array: TreeItem) -> None:
        """Drop texts that do not fit, of elements that are about to have other indices."""
        for key in [key for key in self._wrong if key.startswith(f"{array.path}[")]:
            del self._wrong[key]

    def _rebuild(self) -> None:
        self._tree.rebuild()
        self._changed()

    def _changed(self, key: str = "") -> None:
        """Report a change, of one row's value or of all."""
        wrong = next(iter(self._wrong.values()), None)
        if key:
            self._tree.model.changed(key)
        report(self, valid=wrong is None, refusal=wrong[1] if wrong is not None else "")
        self.messageChanged.emit()

    def _set_tree(self, value: dict[str, Any]) -> None:
        assert self._kind is not None
        self._wrong.clear()
        self._tree.root = None
        self._tree.show(self._kind.create()._schema__, value)
        self._changed()

    # -- the message -----------------------------------------------------------------------------

    @Slot(result=QJSValue)
    def message(self) -> QJSValue:
        """Return the message, with the current time where it is "now"; undefined without one."""
        runtime, root, kind = self._find_runtime(), self._tree.root, self._kind
        if runtime is None or root is None or kind is None or self._wrong:
            return QJSValue()
        try:
            return runtime.message(kind.create(_at(root.value, self._now())), self.DIALECT)
        except Error as error:
            report(self, valid=False, refusal=str(error))
            return QJSValue()

    def _now(self) -> tuple[int, int]:
        node = self.node
        nanoseconds = node.clock.now().nanoseconds if node is not None else 0
        return divmod(nanoseconds, 10**9)

    @Slot(QJSValue, result=bool)
    def load(self, value: QJSValue) -> bool:
        """Show the fields of a message or object; the others have their defaults."""
        kind = self._kind
        if kind is None:
            return False
        try:
            fields = fields_from_js(value, kind)
        except Error as error:
            report(self, refusal=str(error))
            return False
        return self._show(fields)

    @Slot(result=str)
    def json(self) -> str:
        """Return the fields as JSON; empty without a message."""
        root = self._tree.root
        if root is None or self._wrong:
            return ""
        return json.dumps(_plain(root.value))

    @Slot(str, result=bool)
    def loadJson(self, text: str) -> bool:
        """Show fields from JSON, as :meth:`json` returns them."""
        try:
            if len(text) > _MAX_JSON:
                raise ValueError(f"{len(text):,} characters are too many")
            fields = json.loads(text)
            if not isinstance(fields, dict):
                raise ValueError("the fields are an object")
        except (ValueError, RecursionError) as error:
            report(self, refusal=f"this is not a message in JSON: {error}")
            return False
        return self._show(fields)

    def _show(self, fields: dict[str, Any]) -> bool:
        kind = self._kind
        assert kind is not None
        times: list[str] = []
        try:
            schema = kind.create()._schema__
            value = plain_tree(kind.create(_without_now(fields, schema, "", times)))
        except Error as error:
            report(self, refusal=str(error))
            return False
        self._set_tree(_with_now(value, "", set(times)))
        return True

    # -- history and favourites ------------------------------------------------------------------

    def _get_history(self) -> list[str]:
        return [_summary(one) for one in self._kept.history]

    def _get_favourites(self) -> list[str]:
        return [name for name, _ in self._kept.favourites]

    @Slot()
    def remember(self) -> None:
        """Keep the message in the history of its type, as the last one that was sent."""
        text = self.json()
        if text and self._kind is not None:
            store = MessageStore(self._kind.name)
            self._keep(lambda: store.remember(text))

    @Slot(int, result=bool)
    def recall(self, index: int) -> bool:
        """Show a message of the history."""
        known = 0 <= index < len(self._kept.history)
        return known and self.loadJson(self._kept.history[index])

    @Slot(str)
    def addFavourite(self, name: str) -> None:
        """Keep the message as a favourite with this name."""
        text = self.json()
        if text and self._kind is not None:
            store = MessageStore(self._kind.name)
            self._keep(lambda: store.add_favourite(name, text))

    @Slot(str, result=bool)
    def recallFavourite(self, name: str) -> bool:
        """Show a favourite."""
        text = dict(self._kept.favourites).get(name)
        return text is not None and self.loadJson(text)

    @Slot(str)
    def removeFavourite(self, name: str) -> None:
        """Forget a favourite."""
        if self._kind is not None:
            store = MessageStore(self._kind.name)
            self._keep(lambda: store.remove_favourite(name))

    def _keep(self, job: Callable[[], Stored]) -> None:
        session, kind = self._session, self._kind
        if session is None:
            return
        show, post = weak_callback(self._on_kept), session.executor.post

        def run() -> None:
            result: Stored | Error
            try:
                result = job()
            except Error as error:
                result = error
            post(lambda: show(kind, result))

        run_later(run)

    def _on_kept(self, kind: MessageType, result: Stored | Error) -> None:
        if not is_alive(self) or kind is not self._kind:
            return
        if isinstance(result, Stored):
            self._kept = result
            self.keptChanged.emit()
        report(self, keepProblem="" if isinstance(result, Stored) else str(result))


def _load(name: str) -> MessageType:
    """Return the type of the message, request or goal that a form of a type fills in."""
    found = _found(name)
    parts: dict[str, MessageType] = getattr(found, "parts", {"message": found})
    first = next((parts[part] for part in ("message", "request", "goal") if part in parts), None)
    if first is None:
        raise InvalidNameError(f"{name} is not a type of a message, service or action")
    return first


def _found(name: str) -> Any:
    """Return a type of ROS 2, or that of ROS 1, which names actions after a message of theirs."""
    for ros, one in ((2, name), (1, name), (1, name.removesuffix("Action"))):
        with suppress(TypeNotFoundError):  # the next one may exist
            return rosglass.load(one, ros=ros)
    return rosglass.load(name, ros=2)


def _unfolded(schema: Schema) -> list[str]:
    """Return the keys of the nested messages that are unfolded at first: all of a short type."""
    found: list[str] = []
    count = 0
    waiting = [("", schema)]
    while waiting:
        path, one = waiting.pop(0)
        for member in one.members:
            count += 1
            key = f"{path}.{member.name}" if path else member.name
            if member.struct is not None and not member.is_array and not member.struct.is_time:
                found.append(key)
                waiting.append((key, member.struct))
        if count > _MAX_UNFOLDED:
            return []
    return found


def _is_time(item: TreeItem) -> bool:
    return item.schema is not None and item.parent is not None and item.schema.is_time


def _kind_of(row: FieldRow) -> str:
    item = row.item
    if row.span is not None:
        return "range"
    if item.is_array:
        return "array"
    if _is_time(item):
        return "time"
    if item.schema is not None or item.member is None:
        return "message"
    if item.member.number is None:
        # A form's line would lose line breaks.
        return "text" if fits_line(item.value) else "long"
    return "bool" if item.member.number.python is bool else "number"


def _entered(item: TreeItem) -> str:
    """Return a value as it is entered; of an array, what it has."""
    value = item.value
    if _is_time(item):
        if isinstance(value, _Now):
            return _NOW
        seconds, nanoseconds = value.values()
        text = f"{Decimal(int(seconds)) + Decimal(int(nanoseconds)).scaleb(-9):f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    if item.is_leaf and isinstance(value, str) and fits_line(value):
        return value
    return value_text(item)


def _can(row: FieldRow, role: str) -> bool:
    item = row.item
    array = item if item.is_array and row.span is None else item.parent if item.is_element else None
    if array is None:
        return False
    if role in ("canRise", "canSink"):
        return item.is_element and (
            item.row > 0 if role == "canRise" else item.row < array.count - 1
        )
    if array.is_fixed:
        return False
    if role == "canRemove":
        return item.is_element
    return array.bound is None or array.count < array.bound


def _set_value(item: TreeItem, value: Any) -> None:
    parent = item.parent
    assert parent is not None
    if parent.is_array:
        parent._own_list()
    parent.value[item.name] = value
    item.children.clear()


def _time_of(text: str, item: TreeItem) -> dict[str, int]:
    """Return the fields of a time that was entered in seconds, or as "now"."""
    assert item.schema is not None
    seconds_of, nanoseconds_of = (member.name for member in item.schema.members)
    word = text.strip().lower()
    if word == _NOW and item.schema.name.endswith("Time"):
        return _Now({seconds_of: 0, nanoseconds_of: 0})
    expected = 'seconds, such as 1.5, or "now"' if item.schema.name.endswith("Time") else "seconds"
    try:
        if not re.fullmatch(r"[-+]?(\d{1,12}(\.\d*)?|\.\d+)", word):
            raise InvalidOperation
        total = int((Decimal(word) * 10**9).to_integral_value())
    except InvalidOperation:
        raise ConversionError(item.path, text, expected) from None
    seconds, nanoseconds = divmod(total, 10**9)
    made = {seconds_of: seconds, nanoseconds_of: nanoseconds}
    try:
        # The check of single fields knows which times may be negative.
        for name, value in made.items():
            check_leaf(item.child(list(made).index(name)), value)
    except ConversionError:
        raise ConversionError(item.path, text, expected) from None
    return made


def _at(value: Any, now: tuple[int, int]) -> Any:
    """Return values with the times that are "now" replaced."""
    if isinstance(value, _Now):
        return dict(zip(value, now, strict=True))
    if isinstance(value, dict):
        return {name: _at(one, now) for name, one in value.items()}
    if isinstance(value, list):
        return [_at(one, now) for one in value]
    return value


def _plain(value: Any) -> Any:
    """Return values as JSON has them."""
    if isinstance(value, _Now):
        return _NOW
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    # Arrays and scalars of numpy.
    return value.tolist() if hasattr(value, "tolist") else value


def _without_now(value: Any, schema: Schema | None, path: str, times: list[str]) -> Any:
    """Return given fields without "now", and add the paths where it was."""
    if schema is not None and schema.is_time and value == _NOW:
        times.append(path)
        return {}
    if isinstance(value, dict) and schema is not None:
        made = {}
        for name, one in value.items():
            member = schema.by_name.get(name)
            inner = f"{path}.{name}" if path else str(name)
            made[name] = _without_now(one, member.struct if member else None, inner, times)
        return made
    if isinstance(value, list) and schema is not None:
        return [_without_now(one, schema, f"{path}[{at}]", times) for at, one in enumerate(value)]
    return value


def _with_now(value: Any, path: str, times: set[str]) -> Any:
    if not times:
        return value
    if path in times:
        return _Now(value)
    if isinstance(value, dict):
        return {
            name: _with_now(one, f"{path}.{name}" if path else name, times)
            for name, one in value.items()
        }
    if isinstance(value, list):
        return [_with_now(one, f"{path}[{at}]", times) for at, one in enumerate(value)]
    return value


def _summary(text: str) -> str:
    """Return a kept message in one line: the values of its fields."""
    plain = re.sub(r'[{}"]', "", text)
    return bounded(plain, 120)
