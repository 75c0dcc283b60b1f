"""The rows of the Displays panel: options, displays, their status and their settings."""
# ruff: noqa: N802, N815 - the names of slots, signals and properties are Qt's

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from PySide6.QtCore import QAbstractListModel, QModelIndex
from PySide6.QtGui import QColor

from rosglass.errors import Error
from rosglass.interfaces.names import ros1_name
from rosglass.qml.engine.properties import Writable
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import FIXED_FRAME
from rosglass.scene.view.display_configs import GroupDisplay, UnknownDisplay, duplicate_display
from rosglass.scene.view.scene_view import SceneView

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rosglass.scene.configs.settings import Setting
    from rosglass.scene.displays.display import Display
    from rosglass.scene.displays.parts import Parts

__all__ = ["DisplaysModel", "PanelRow"]

#: Milliseconds between two looks at what has no signal of its own.
_REFRESH_MS = 250
#: Namespaces, frames or links of a display that are listed, and characters of their names.
_MAX_PARTS, _MAX_NAME_LENGTH = 2000, 200
#: Shares of a group's row at which a display is dropped above or below it, not into it.
_EDGE = 0.25
_FRAME_ROW, _BACKGROUND = "Fixed Frame", "Background Color"


class PanelRow(NamedTuple):
    """A row of the panel.

    Attributes:
        key: An identity that stays while values change.
        depth: Levels of indentation.
        label: Its name.
        kind: Of the setting, or ``options``, ``display``, ``status``, ``list`` of what is below it,
            ``part`` of a display, e.g. a namespace, ``text`` that is shown only.
        value: The shown value.
        description: For the tooltip.
        level: ``ok``, ``warn`` or ``error``.
        checked: For displays and parts: whether it is enabled.
        expandable: Whether it has rows below it.
        expanded: Whether these are shown.
        choices: The values of enumerations and names of frames.
        placeholder: The meaning of an empty value.
    """

    key: tuple[Any, ...]
    depth: int
    label: str
    kind: str
    value: Any = ""
    description: str = ""
    level: str = "ok"
    checked: bool = True
    expandable: bool = False
    expanded: bool = False
    choices: tuple[str, ...] = ()
    placeholder: str = ""


class _Landing(NamedTuple):
    """The destination of a dropped display.

    Attributes:
        group: The group.
        before: The display that it goes in front of; None for the end.
        row: The row that it goes in front of.
        depth: Levels of indentation there.
        into: Whether it goes into the group of that row, as the last one.
    """

    group: Display | None
    before: Display | None
    row: int
    depth: int
    into: bool = False


#: Qt.ItemDataRole.UserRole; its name would make PySide load all of Qt's enumerations.
_USER_ROLE = 0x0100
_ROLES = {_USER_ROLE + number: name for number, name in enumerate(PanelRow._fields[1:], 1)}


@cache
def _tree_of(paths: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the names of the settings below each path, in their order."""
    found: dict[str, list[str]] = {}
    for path in paths:
        parts = path.split("/")
        for level in range(len(parts)):
            below = found.setdefault("/".join(parts[:level]), [])
            if parts[level] not in below:
                below.append(parts[level])
    return found


def _short(name: str) -> str:
    """Return a name of the robot's as a row shows it: it may be of any length."""
    return name if len(name) <= _MAX_NAME_LENGTH else f"{name[:_MAX_NAME_LENGTH]}\u2026"


def _shortest(number: float) -> str:
    # Vectors have 32 bits: no digit is lost where another one is edited.
    return np.format_float_positional(np.float32(number), trim="-")


def _text(value: Any) -> Any:
    """Return a value as the panel shows it."""
    if isinstance(value, QColor):
        return value.name()
    if hasattr(value, "scalar"):
        return "; ".join(map(_shortest, (value.x(), value.y(), value.z(), value.scalar())))
    if hasattr(value, "toVector4D"):
        return "; ".join(map(_shortest, (value.x(), value.y(), value.z())))
    if isinstance(value, float):
        return f"{value:.6g}"
    return value


def _value(setting: Setting, text: Any) -> Any:
    """Return the user's input as a value of the setting.

    Raises:
        Error: It does not fit.
    """
    kind = setting.kind.NAME
    if kind in ("vector", "quaternion") and isinstance(text, str):
        names = "xyzw"[: 3 if kind == "vector" else 4]
        numbers = text.replace(";", " ").replace(",", " ").split()
        if len(numbers) != len(names):
            raise Error(f"expected {len(names)} numbers, e.g. {'; '.join('0' * len(names))}")
        return setting.kind.restore(dict(zip(names, numbers, strict=True)))
    if kind in ("int", "float") and isinstance(text, str):
        return setting.kind.restore(text.strip())
    return setting.kind.read(text)


class DisplaysModel(QAbstractListModel):
    """The rows of a Displays panel, flat, each with its depth; a base of lists in QML.

    ``view`` is the :class:`SceneView` that it shows and changes.
    """

    viewChanged = Signal()
    #: The user has entered something that does not fit: why.
    refused = Signal(str)
    #: The user's input was set.
    accepted = Signal()

    def __init__(self, parent: QtCore.QObject | None = None) -> None:
        super().__init__(parent)
        self._view: SceneView | None = None
        self._rows: list[PanelRow] = []
        #: The robot's topics; None until they are needed in this refresh.
        self._seen_topics: list[tuple[str, list[str]]] | None = None
        self._expanded: set[tuple[Any, ...]] = {("options",)}
        self._picked: tuple[Any, ...] = ()
        self._timer = QtCore.QTimer(self)
        self._timer.setInterval(_REFRESH_MS)
        self._timer.timeout.connect(self.refresh)

    def _get_view(self) -> SceneView | None:
        return self._view

    def _set_view(self, view: Any) -> None:
        if view is self._view or not (view is None or isinstance(view, SceneView)):
            return
        self._view = view
        if view is not None:
            view.scene.displaysChanged.connect(self.refresh)
        self.viewChanged.emit()
        self._follow()

    def _follow(self) -> None:
        """Follow the view by a timer, or stop that."""
        if self._view is None or not self.active:
            self._timer.stop()
        else:
            self._timer.start()
        self.refresh()

    #: The view that is shown.
    view = Property(QtCore.QObject, _get_view, _set_view, notify=viewChanged)

    #: Whether it follows what changes by itself, e.g. the status; not needed while it is hidden.
    active = Writable(bool, True, then="_follow")
    #: Whether rows stay as they are, while one of them is dragged.
    frozen = Writable(bool, False, then="refresh")

    @property
    def rows(self) -> list[PanelRow]:
        """The visible rows, from the top."""
        return list(self._rows)

    # -- Qt's model ------------------------------------------------------------------------------

    def rowCount(self, parent: Any = None) -> int:  # noqa: ARG002 - Qt's signature
        """Return the number of rows."""
        return len(self._rows)

    def roleNames(self) -> dict[int, QtCore.QByteArray]:
        """Return the names of the roles in QML."""
        return {role: QtCore.QByteArray(name.encode()) for role, name in _ROLES.items()}

    def data(self, index: Any, role: int = 0) -> Any:
        """Return a part of a row."""
        if not 0 <= index.row() < len(self._rows) or role not in _ROLES:
            return None
        value = getattr(self._rows[index.row()], _ROLES[role])
        return list(value) if isinstance(value, tuple) else value

    # -- rows ------------------------------------------------------------------------------------

    @Slot(int, result=int)
    def collapsedInto(self, row: int) -> int:
        """Return the row that a setting or part is about to be hidden below; -1 for a display."""
        above, gone = self._rows[row - 1], self._rows[row]
        hidden = row > 0 and gone.kind != "display" and above.depth < gone.depth
        return row - 1 if hidden else -1

    @Slot()
    def refresh(self) -> None:
        """Show changes."""
        if not is_alive(self) or self.frozen:
            return
        view = self._view
        self._seen_topics = None
        new = list(self._walk(view)) if view is not None and is_alive(view) else []
        if [row.key for row in new] != [row.key for row in self._rows]:
            self._change_rows(new)
        before, self._rows = self._rows, new
        for number, (one, other) in enumerate(zip(before, new, strict=True)):
            if one != other:
                index = self.index(number)
                self.dataChanged.emit(index, index)

    def _change_rows(self, new: list[PanelRow]) -> None:
        """Remove and insert rows, as few as possible: an editor that is open stays so."""
        known, wanted = {row.key for row in self._rows}, {row.key for row in new}
        here = [row.key for row in self._rows if row.key in wanted]
        there = [row.key for row in new if row.key in known]
        # All of them, unless displays were moved.
        start = end = 0
        while start < len(here) and here[start] == there[start]:
            start += 1
        while end < len(here) - start and here[-1 - end] == there[-1 - end]:
            end += 1
        kept = {*here[:start], *here[len(here) - end :]}
        first = len(self._rows)
        while first > 0:
            last = first = first - 1
            if self._rows[first].key not in kept:
                while first > 0 and self._rows[first - 1].key not in kept:
                    first -= 1
                self.beginRemoveRows(QModelIndex(), first, last)
                del self._rows[first : last + 1]
                self.endRemoveRows()
        last = -1
        while last + 1 < len(new):
            first = last = last + 1
            if new[first].key not in kept:
                while last + 1 < len(new) and new[last + 1].key not in kept:
                    last += 1
                self.beginInsertRows(QModelIndex(), first, last)
                self._rows[first:first] = new[first : last + 1]
                self.endInsertRows()

    def _walk(self, view: SceneView) -> Iterator[PanelRow]:
        scene = view.scene
        key = ("options",)
        yield PanelRow(
            key, 0, "Global Options", "options", expandable=True, expanded=key in self._expanded
        )
        if key in self._expanded:
            frames = tuple(scene.frames())
            yield PanelRow(
                (*key, _FRAME_ROW), 1, _FRAME_ROW, "frame", scene.fixed_frame,
                "Frame in which everything is placed.", choices=frames,
            )  # fmt: skip
            yield PanelRow(
                (*key, _BACKGROUND), 1, _BACKGROUND, "color",
                view.property("background").name(), "Colour of the background.",
            )  # fmt: skip
        problem, level = str(view.property("problem")), "error"
        session = scene._session
        if not problem and session is not None and session.state != "connected":
            level = "error" if session.state == "failed" else "warn"
            problem = ": ".join(filter(None, (session.state, session.detail)))
        yield PanelRow(
            ("status",), 0, "Global Status", "status", problem or "Ok", problem,
            level if problem else "ok",
        )  # fmt: skip
        yield from self._walk_group(view, None, 0)

    def _walk_group(self, view: SceneView, group: Display | None, depth: int) -> Iterator[PanelRow]:
        for display in view.scene.displays:
            if display.group is not group or not is_alive(display):
                continue
            key = ("display", id(display))
            expanded = key in self._expanded
            yield PanelRow(
                key, depth, display.name, "display", display.TYPE, display.statusText,
                display.statusLevel, bool(display.enabled), expandable=True, expanded=expanded,
            )  # fmt: skip
            if expanded:
                yield from self._walk_display(display, key, depth + 1)
                if isinstance(display, GroupDisplay):
                    yield from self._walk_group(view, display, depth + 1)

    def _walk_display(self, display: Display, key: Any, depth: int) -> Iterator[PanelRow]:
        if display.status_lines:
            own, level = (*key, "status"), display.statusLevel
            # What is wrong is not hidden.
            expanded = level != "ok" or own in self._expanded
            yield PanelRow(
                own, depth, f"Status: {level.title()}", "status", "", display.statusText, level,
                expandable=level == "ok", expanded=expanded,
            )  # fmt: skip
            for name, line in display.status_lines.items() if expanded else ():
                yield PanelRow(
                    (*own, name), depth + 1, name, "status", line.text, line.text, line.level
                )
        yield from self._walk_settings(display, key, depth, "")

    def _walk_settings(
        self, display: Display, key: Any, depth: int, above: str
    ) -> Iterator[PanelRow]:
        """Iterate over the settings below a path, and what is below those that are expanded."""
        parts, tree = display.parts, _tree_of(tuple(display.SETTINGS))
        names = list(tree.get(above, ()))
        if parts is not None and not above and parts.title not in names:
            names.append(parts.title)
        for name in names:
            path = f"{above}/{name}" if above else name
            setting = display.SETTINGS.get(path)
            if setting is not None and not setting.is_shown(display):
                continue
            is_list = parts is not None and path == parts.title
            own = (*key, path)
            below = (display.SETTINGS.get(f"{path}/{one}") for one in tree.get(path, ()))
            expandable = is_list or any(one is None or one.is_shown(display) for one in below)
            expanded = expandable and own in self._expanded
            if setting is None:
                yield PanelRow(own, depth, name, "list", expandable=True, expanded=expanded)
            else:
                yield PanelRow(
                    own, depth, name, setting.kind.NAME, _text(getattr(display, setting.name)),
                    setting.description, expandable=expandable, expanded=expanded,
                    choices=self._choices(display, setting), placeholder=display.placeholder(path),
                )  # fmt: skip
            if expandable and expanded:
                yield from self._walk_settings(display, key, depth + 1, path)
                if parts is not None and is_list:
                    yield from self._walk_parts(parts, own, depth + 1)

    def _walk_parts(self, parts: Parts, key: Any, depth: int) -> Iterator[PanelRow]:
        names = list(parts.names())
        expandable = bool(parts.details) or parts.describe is not None
        for name in names[:_MAX_PARTS]:
            own = (*key, name)
            expanded = expandable and own in self._expanded
            yield PanelRow(
                own, depth, _short(name), "part" if parts.can_switch(name) else "list",
                checked=parts.is_enabled(name), expandable=expandable, expanded=expanded,
            )  # fmt: skip
            for detail, setting in parts.details.items() if expanded else ():
                yield PanelRow(
                    (*own, detail), depth + 1, detail, setting.kind.NAME,
                    _text(parts.get(name, detail)), setting.description,
                )  # fmt: skip
            if expanded and parts.describe is not None:
                for line, text in parts.describe(name):
                    yield PanelRow((*own, line), depth + 1, line, "text", _short(text))
        if len(names) > _MAX_PARTS:
            rest = f"and {len(names) - _MAX_PARTS} more"
            yield PanelRow((*key, "", ""), depth, rest, "list")

    def _choices(self, display: Display, setting: Setting) -> tuple[str, ...]:
        if setting.kind.NAME == "enum":
            return tuple(setting.kind.options["choices"])
        if setting.kind.NAME == "frame" and display.scene is not None:
            return (FIXED_FRAME, *display.scene.frames())
        if setting.kind.NAME == "topic":
            wanted = display.suggested(setting.path)
            return tuple(name for name, kinds in self._topics() if set(kinds) & set(wanted))
        return ()

    def _topics(self) -> list[tuple[str, list[str]]]:
        if self._seen_topics is None:
            self._seen_topics = self._list_topics()
        return self._seen_topics

    def _list_topics(self) -> list[tuple[str, list[str]]]:
        node = self._view.scene.node if self._view is not None else None
        if node is None:
            return []
        try:
            return [
                (name, [ros1_name(kind) for kind in kinds])
                for name, kinds in sorted(node.topics().items())
            ]
        except Error:
            return []

    # -- changes ---------------------------------------------------------------------------------

    def _display_at(self, row: int) -> Display | None:
        if self._view is None or not 0 <= row < len(self._rows):
            return None
        key = self._rows[row].key
        displays = self._view.scene.displays
        return next((one for one in displays if key[:2] == ("display", id(one))), None)

    @Slot(int)
    def toggle(self, row: int) -> None:
        """Show or hide the rows below one."""
        if 0 <= row < len(self._rows):
            self._expanded ^= {self._rows[row].key}
            self.refresh()

    @Slot(int, bool)
    def setEnabled(self, row: int, enabled: bool) -> None:
        """Show or hide a display, or a part of it."""
        display = self._display_at(row)
        if display is None:
            return
        if self._rows[row].kind == "display":
            display.enabled = enabled
        elif self._rows[row].kind == "part" and display.parts is not None:
            display.parts.set_enabled(self._rows[row].key[-1], enabled)
        self.refresh()

    @Slot(int, "QVariant")
    def edit(self, row: int, text: Any) -> None:
        """Change the setting of a row to what the user has entered."""
        view, display = self._view, self._display_at(row)
        if view is None or not 0 <= row < len(self._rows):
            return
        *_, part, path = self._rows[row].key
        try:
            if display is not None and path in display.SETTINGS and len(self._rows[row].key) == 3:
                display.set(path, _value(display.SETTINGS[path], text))
            elif display is not None and display.parts and path in display.parts.details:
                detail = display.parts.details[path]
                display.parts.set(part, path, _value(detail, text))
            elif path == _FRAME_ROW:
                view.scene.fixed_frame = text
            elif path == _BACKGROUND:
                color = QColor(text)
                if not color.isValid():
                    raise Error(f"expected a colour, e.g. '#303030', got {text!r}")
                view.setProperty("background", color)
        except Error as error:
            self.refused.emit(f"{path}: {error}")
        else:
            self.accepted.emit()
        self.refresh()
        # An editor shows again what the setting has.
        index = self.index(row)
        self.dataChanged.emit(index, index)

    @Slot(int)
    def pick(self, row: int) -> None:
        """Remember a row whose value a dialog changes; others may come and go until then."""
        if 0 <= row < len(self._rows):
            self._picked = self._rows[row].key

    @Slot("QVariant")
    def setPicked(self, value: Any) -> None:
        """Change the setting of the row that was picked, if it is still there."""
        for number, row in enumerate(self._rows):
            if row.key == self._picked:
                self.edit(number, value)
                return

    @Slot(int, str)
    def rename(self, row: int, name: str) -> None:
        """Rename a display."""
        display = self._display_at(row)
        if display is not None and name.strip():
            display.name = name.strip()
            self.refresh()

    @Slot(int, result=int)
    def duplicate(self, row: int) -> int:
        """Add another display like one; return the row of the new one."""
        display = self._display_at(row)
        if display is None or self._view is None:
            return row
        try:
            made = duplicate_display(self._view.scene, display)
        except Error as error:
            self.refused.emit(str(error))
            return row
        self.refresh()
        return self._row_of(made)

    @Slot(int)
    def remove(self, row: int) -> None:
        """Remove a display, with those in it."""
        display = self._display_at(row)
        if display is None or self._view is None:
            return
        self._view.scene.remove(display)

    # -- order -----------------------------------------------------------------------------------

    def _find_landing(self, source: int, row: int, part: float) -> _Landing | None:
        """Return where a display goes that is dropped on a row; None where it cannot go."""
        moved, target = self._display_at(source), self._display_at(row)
        if moved is None or self._view is None:
            return None
        rows = self._rows
        if target is None:
            if row >= len(rows):
                return _Landing(None, None, len(rows), 0)
            # The rows above the displays.
            first = next(self._inside(None), None)
            return _Landing(None, first, self._row_of(first), 0)
        head = self._row_of(target)
        depth, expanded = rows[head].depth, rows[head].expanded
        end = head + 1
        while end < len(rows) and rows[end].depth > depth:
            end += 1
        if isinstance(target, GroupDisplay) and row == head and part >= _EDGE:
            if expanded and part > 1 - _EDGE:
                found = _Landing(target, next(self._inside(target), None), head + 1, depth + 1)
            elif expanded or part <= 1 - _EDGE:
                found = _Landing(target, None, head, depth, into=True)
            else:
                found = _Landing(target.group, self._next_to(target), end, depth)
        elif row == head and part < 0.5:
            found = _Landing(target.group, target, head, depth)
        else:
            found = _Landing(target.group, self._next_to(target), end, depth)
        above = found.group
        while above is not None and above is not moved:
            above = above.group
        return found if above is None else None

    def _row_of(self, display: Display | None) -> int:
        key = ("display", id(display))
        rows = enumerate(self._rows)
        return next((number for number, row in rows if row.key == key), len(self._rows))

    def _inside(self, group: Display | None) -> Iterator[Display]:
        """Iterate over the displays in a group; in none for None."""
        displays = self._view.scene.displays if self._view is not None else []
        return (one for one in displays if one.group is group)

    def _next_to(self, display: Display) -> Display | None:
        """Return the display after one in its group; None for the last one."""
        beside = list(self._inside(display.group))
        return next(iter(beside[beside.index(display) + 1 :]), None)

    @Slot(int, int, float, result="QVariantMap")
    def dropTarget(self, source: int, row: int, part: float) -> dict[str, Any]:
        """Return where a display goes that is dropped on a row, for what shows it.

        Args:
            source: Row of the display.
            row: Row that it is dropped on; the number of rows for below the last one.
            part: Position in this row, from 0 at its upper edge to 1 at its lower edge.

        Returns:
            `row` that it goes in front of, `depth`, and `into`, whether it goes into the group of
            that row; empty where it cannot go.
        """
        found = self._find_landing(source, row, part)
        return {} if found is None else {"row": found.row, "depth": found.depth, "into": found.into}

    @Slot(int, int, float, result=int)
    def drop(self, source: int, row: int, part: float) -> int:
        """Move a display to where it is dropped; arguments as of :meth:`dropTarget`.

        Returns:
            The row of the display afterwards.
        """
        display, found = self._display_at(source), self._find_landing(source, row, part)
        if display is None or found is None:
            return source
        before = found.before
        if before is display:
            before = self._next_to(display)
        return self._move(display, before, found.group)

    @Slot(int, str, result=int)
    def shift(self, row: int, direction: str) -> int:
        """Move a display by one, for the keyboard.

        Args:
            row: Its row.
            direction: ``up`` or ``down`` among those in its group, ``in`` to the group above it,
                ``out`` of its group.

        Returns:
            The row of the display afterwards.
        """
        display = self._display_at(row)
        if display is None or self._rows[row].kind != "display":
            return row
        group = display.group
        beside = list(self._inside(group))
        at = beside.index(display)
        if direction == "up" and at > 0:
            return self._move(display, beside[at - 1], group)
        if direction == "down" and at + 1 < len(beside):
            return self._move(display, next(iter(beside[at + 2 :]), None), group)
        if direction == "in" and at > 0 and isinstance(beside[at - 1], GroupDisplay):
            return self._move(display, None, beside[at - 1])
        if direction == "out" and group is not None:
            return self._move(display, self._next_to(group), group.group)
        return row

    def _move(self, display: Display, before: Display | None, group: Display | None) -> int:
        assert self._view is not None
        try:
            self._view.scene.move(display, before, group)
        except Error as error:
            self.refused.emit(str(error))
        if group is not None:
            self._expanded.add(("display", id(group)))
        self.frozen = False
        self.refresh()
        return self._row_of(display)

    @Slot(result="QVariantList")
    def types(self) -> list[str]:
        """Return the types of displays that can be added."""
        if self._view is None:
            return []
        hidden = {UnknownDisplay.TYPE}
        return sorted(set(self._view.scene.TYPES) - hidden)

    @Slot(result="QVariantList")
    def suggestions(self) -> list[dict[str, str]]:
        """Return the robot's topics that a display can show: topic, its type, and the display."""
        if self._view is None:
            return []
        found = []
        for topic, kinds in self._list_topics():
            for name, display in sorted(self._view.scene.TYPES.items()):
                shown = set(getattr(display, "SUGGESTED", ()) or getattr(display, "MESSAGES", ()))
                if shown & set(kinds):
                    found.append({"topic": topic, "type": kinds[0], "display": name})
        return found

    @Slot(str, str, result=int)
    def add(self, kind: str, topic: str = "") -> int:
        """Add a display of a type, for a topic if there is one; return its row, -1 for none."""
        if self._view is None:
            return -1
        try:
            settings = {"topic": topic} if topic else {}
            display = self._view.scene.add(kind, "", **settings)
        except Error as error:
            self.refused.emit(str(error))
            return -1
        self._expanded.add(("display", id(display)))
        self.refresh()
        return self._row_of(display)
