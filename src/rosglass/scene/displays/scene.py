"""The scene: fixed frame, transforms, and the displays that draw into it."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import logging
import math
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar

from rosglass.comm.names import similar
from rosglass.errors import ArgumentError, Error, TransformException
from rosglass.overlay.property_values import shown
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.displays.display import Display
from rosglass.scene.displays.scene_frames import SceneFrames

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from rosglass.comm.clock import Jump
    from rosglass.qml.engine.runtime import Runtime

__all__ = ["Scene"]

_log = logging.getLogger("rosglass.scene")
#: Seconds between two looks at transforms that have changed: below 1/30, so that each of 30
#: messages a second is seen.
_TRANSFORMS_S = 0.03
#: Seconds between two resets as the time jumps back again and again.
_RESETS_S = 1.0


class Scene(SceneFrames):
    """The content of a view: displays, placed in one frame by the robot's transforms.

    One belongs to each ``SceneView``. Used in the GUI thread.
    """

    #: Something drawn has changed.
    changed = Signal()
    #: Displays were added, removed or moved.
    displaysChanged = Signal()
    #: Image displays were added, removed or moved.
    picturesChanged = Signal()
    #: Transforms were received, or data has to be placed anew.
    placed = Signal()

    #: Types of displays by their name in RViz, e.g. ``Grid``.
    TYPES: ClassVar[Mapping[str, type[Display]]] = {}

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._displays: list[Display] = []
        self._pictures: list[Display] = []
        #: How many callers of :meth:`changing` there are, and whether displays have changed since.
        self._changing, self._has_changed = 0, False
        self._ticks = 0
        super().__init__(parent, runtime)
        self._timer = single_shot(self, self._follow)
        self._followed_at = self._reset_at = -math.inf
        self._resets = single_shot(self, self._begin_anew)
        self.root.on_change = self.changed.emit
        root = self.root

        def end() -> None:
            # Its displays may be destroyed later.
            root.on_change = None

        self.destroyed.connect(end)

    # -- displays --------------------------------------------------------------------------------

    @property
    def displays(self) -> list[Display]:
        """All displays, in the order in which they were added."""
        return list(self._displays)

    #: All displays, for QML.
    displayList = Property(list, lambda self: list(self._alive()), notify=displaysChanged)
    #: The displays with an image, for an ``ImagePanel``.
    pictureList = Property(
        list, lambda self: list(filter(is_alive, self._pictures)), notify=picturesChanged
    )

    @contextmanager
    def changing(self) -> Iterator[None]:
        """Announce all changes of displays at the end, once: each costs as much as there are."""
        self._changing += 1
        try:
            yield
        finally:
            self._changing -= 1
            if self._has_changed and not self._changing:
                self._announce_displays()

    def _announce_displays(self) -> None:
        self._has_changed = bool(self._changing)
        if self._has_changed or not is_alive(self):
            return
        pictures = [one for one in self._alive() if hasattr(one, "isPicture")]
        before, self._pictures = self._pictures, pictures
        self.displaysChanged.emit()
        if pictures != before:
            self.picturesChanged.emit()

    def add(self, kind: str | Display, name: str = "", **settings: Any) -> Display:
        """Add a display.

        Args:
            kind: A display, or the name of its type in RViz, e.g. ``PointCloud2``.
            name: Its name; that of the type by default.
            settings: Values of its properties, e.g. ``topic="/points"``.

        Raises:
            Error: There is no such type or property, or a value does not fit; or the display is in
                another scene.
        """
        if isinstance(kind, str):
            found = self.TYPES.get(kind) or self.TYPES.get(kind.rpartition("/")[2])
            if found is None:
                hint = similar(kind, self.TYPES) or f"; there are: {', '.join(sorted(self.TYPES))}"
                raise Error(f"there is no type of displays {shown(kind)}{hint}")
            display = found(self, self._find_runtime())
            by_name = {setting.name: path for path, setting in found.SETTINGS.items()}
            try:
                for key, value in settings.items():
                    if key not in by_name:
                        raise Error(f"{kind} has no property {key!r}{similar(key, by_name)}")
                    display.set(by_name[key], value)
            except Error:
                display.deleteLater()
                raise
        else:
            display = _checked(kind)
        if name:
            display.name = name
        self.adopt(display)
        return display

    def adopt(self, display: Display) -> None:
        """Show a display.

        Raises:
            Error: The display is in another scene, or is not a display.
        """
        if _checked(display) in self._displays:
            return
        if display.scene is not None and is_alive(display.scene):
            raise Error(f"{display.label} is in another scene; make one for each scene")
        self._displays.append(display)
        root, displays = display.root, self._displays
        announce = weak_callback(self._announce_displays)

        def forget() -> None:
            # QML has destroyed it: only its Python half is left.
            root.remove()
            if display in displays:
                displays.remove(display)
                # Later: all of a view may be about to be destroyed.
                QtCore.QTimer.singleShot(0, announce)

        display.destroyed.connect(forget)
        self._call(display, lambda one: one.join(self), "Setup")
        self._announce_displays()

    def remove(self, display: Display) -> None:
        """Remove a display, and if it is a group, the displays in it.

        Raises:
            Error: It is not in this scene.
        """
        self._check_own(display)
        for inner in self.displays:
            if inner.group is display and inner in self._displays:
                self.remove(inner)
        self._displays.remove(display)
        display.leave()
        self._announce_displays()
        display.deleteLater()

    def move(
        self, display: Display, before: Display | None = None, group: Display | None = None
    ) -> None:
        """Move a display to another place of the list, or into another group.

        Args:
            display: The display; one that is a group takes along what is in it.
            before: The display that it goes in front of, in the same group; None for the end.
            group: The group that it goes into; None for none.

        Raises:
            Error: One of them is not in this scene, `before` is not in `group`, or a group would be
                in itself.
        """
        self._check_own(display)
        for one in (before, group):
            if one is not None:
                self._check_own(one)
        if group is not None and group.TYPE != "Group":
            raise Error(f"{group.label} is not a group")
        above = group
        while above is not None:
            if above is display:
                raise Error(f"{display.label} cannot be moved into itself")
            above = above.group
        if before is display:
            return
        if before is not None and before.group is not group:
            raise Error(f"{before.label} is not in {'the list' if group is None else group.label}")
        was_shown = display.shown
        self._displays.remove(display)
        at = len(self._displays) if before is None else self._displays.index(before)
        self._displays.insert(at, display)
        display.group = group
        self._displays[:] = list(self._in_order(None))
        (self.root if group is None else group.root).add(display.root)
        if display.shown != was_shown:
            display.on_group_enabled()
        self._announce_displays()

    def _check_own(self, display: Display) -> None:
        if display not in self._displays:
            label = display.label if isinstance(display, Display) else shown(display)
            raise Error(f"{label} is not in this scene, whose displays are in Scene.displays")

    def _in_order(self, group: Display | None) -> Iterator[Display]:
        """Iterate over the displays of a group, each before those in it, as panels list them."""
        for display in self._displays:
            if display.group is group:
                yield display
                if display.TYPE == "Group":
                    yield from self._in_order(display)

    def find(self, name: str) -> Display | None:
        """Return the first display of a name."""
        return next((one for one in self._displays if one.name == name), None)

    def set_draws_in_software(self, draws_in_software: bool) -> None:
        """Set whether the processor draws; displays then prepare data so that it is faster."""
        if draws_in_software != self.draws_in_software:
            self.draws_in_software = draws_in_software
            self._each(lambda display: display._renew_preparer())

    @Slot()
    def _on_tick(self) -> None:
        """Check twice a second for displays whose frames are no longer updated."""
        self._ticks += 1
        self._watch_time()
        if self._ticks % 5:
            return
        self._check_transforms()
        node = self.node
        self.has_tf_publishers = node is not None and bool(node.publishers("tf"))
        for display in self._alive():
            self._call(display, lambda one: one.check_frames())

    # -- following the robot ---------------------------------------------------------------------

    def _on_transforms(self) -> None:
        if is_alive(self) and not self._timer.isActive():
            wait = self._followed_at + _TRANSFORMS_S - time.monotonic()
            self._timer.start(int(max(wait, 0.0) * 1000))

    @Slot()
    def _follow(self) -> None:
        self._followed_at = time.monotonic()
        self._each(lambda display: display.on_transforms())
        self.placed.emit()

    def _on_files(self, uris: Collection[str]) -> None:
        for display in self._alive():
            self._call(display, lambda one: one.on_files(uris))

    def _place_anew(self) -> None:
        self._each(lambda display: display.on_fixed_frame())
        self.placed.emit()

    def _on_jump(self, jump: Jump) -> None:  # noqa: ARG002 - the clock's signature
        """Begin anew after a jump of the robot's time, but not at each of many."""
        if is_alive(self) and not self._resets.isActive():
            wait = self._reset_at + _RESETS_S - time.monotonic()
            self._resets.start(int(max(wait, 0.0) * 1000))

    @Slot()
    def reset(self) -> None:
        """Drop all data that was received, and subscribe anew: latched messages come again.

        Transforms are dropped as well, except static ones, also for other users of the session's.
        """
        buffer = self.transforms
        if buffer is not None:
            buffer.clear()
        self._begin_anew()

    @Slot()
    def _begin_anew(self) -> None:
        """Drop received messages of displays; after a jump, tf's listener clears the transforms."""

        def restart(display: Display) -> None:
            display._close_endpoint()
            display._schedule()
            display.reset()

        self._reset_at = time.monotonic()
        self._retry_files()
        self._each(restart)

    def _each(self, job: Callable[[Display], None]) -> None:
        for display in self._alive():
            if display.shown and self._call(display, job):
                display.delete_status("Display")

    def _call(
        self, display: Display, job: Callable[[Display], None], line: str = "Display"
    ) -> bool:
        """Return whether a job has not failed; otherwise the display says so, and others go on."""
        try:
            job(display)
        except TransformException as error:
            display.set_status("Transform", "error", str(error))
        except Exception as error:  # the other displays are shown all the same
            _log.exception("%s", display.label)
            display.set_status(line, "error", repr(error))
        else:
            return True
        return False

    def _alive(self) -> Iterator[Display]:
        return (display for display in self.displays if is_alive(display))


def _checked(display: Any) -> Display:
    if not isinstance(display, Display):
        raise ArgumentError("display", display, "a display, or the name of its type, e.g. 'Grid'")
    return display
