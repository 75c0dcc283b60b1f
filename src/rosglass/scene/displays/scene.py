"""The scene: fixed frame, transforms, and the displays that draw into it."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import logging
import math
import time
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rosglass.comm.executor import Dispatcher
from rosglass.comm.names import similar
from rosglass.comm.time import Time
from rosglass.errors import ArgumentError, Error, LookupException, TransformException
from rosglass.overlay.property_values import shown
from rosglass.qml.elements.element import Element, single_shot
from rosglass.qml.elements.tf_buffer import TfLink
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import Property, QtCore, Signal, Slot, is_alive
from rosglass.scene.displays.display import Display
from rosglass.scene.render.arrays import are_drawable
from rosglass.scene.render.matrices import instance_matrix, poses_matrices
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from rosglass.comm.clock import Jump
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.tf import TransformBuffer

__all__ = ["Scene"]

_log = logging.getLogger("rosglass.scene")
#: Seconds between two looks at transforms that have changed: below 1/30, so that each of 30
#: messages a second is seen.
_TRANSFORMS_S = 0.03
#: Frames that are listed.
_MAX_FRAMES = 10_000
_ORIGIN, _UPRIGHT = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
#: Seconds without a change of the robot's time after which a simulation is paused.
_PAUSED_S = 1.0
#: Seconds between two resets as the time jumps back again and again.
_RESETS_S = 1.0
#: Seconds until servers of files that have not answered are asked again, and at most then.
_ASK_AGAIN_S, _MAX_ASK_AGAIN_S = 10.0, 300.0


class Scene(Element):
    """The content of a view: displays, placed in one frame by the robot's transforms.

    One belongs to each ``SceneView``. Used in the GUI thread.

    Attributes:
        root: All drawables, in the fixed frame.
        ask_again_s: After how many seconds a robot is asked again for files that it did not send.
        draws_in_software: Whether the processor draws, as far as is known.
        has_tf_publishers: Whether transforms have a publisher.
    """

    #: Something drawn has changed.
    changed = Signal()
    fixedFrameChanged = Signal()
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
        self.root = Group()
        self.draws_in_software = False
        self.has_tf_publishers = True
        #: The retriever of meshes and textures, once something has been loaded.
        self._resources: list[ResourceRetriever] = []
        self._fixed_frame = "map"
        self._displays: list[Display] = []
        self._pictures: list[Display] = []
        #: How many callers of :meth:`changing` there are, and whether displays have changed since.
        self._changing, self._has_changed = 0, False
        self._link: TfLink | None = None
        self._watch: Any = None
        self._loader: Dispatcher | None = None
        #: The receivers of results of the jobs in its thread, which must not hold displays.
        self._takers: dict[object, Callable[[Any], None]] = {}
        self._ticks = 0
        #: The robot's simulated time, when it has changed, and when it last stood still.
        self._simulated_ns = 0
        self._time_changed_at, self._paused_at = math.inf, -math.inf
        super().__init__(parent, runtime)
        self._timer = single_shot(self, self._follow)
        self._followed_at = self._reset_at = -math.inf
        self._resets = single_shot(self, self._begin_anew)
        self._ask_timer = single_shot(self, self._ask_again)
        self.ask_again_s = _ASK_AGAIN_S
        self.root.on_change = self.changed.emit
        root = self.root

        def end() -> None:
            # Its displays may be destroyed later.
            root.on_change = None

        self.destroyed.connect(end)

    def _find_runtime(self) -> Runtime | None:
        if self._runtime is None:
            # Made by a view: QML knows the view only.
            view = self.parent()
            self._runtime = runtime_of(view) if view is not None else None
        return self._runtime

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
        try:
            display.join(self)
        except Exception as error:
            # The others are shown all the same.
            _log.exception("%s", display.label)
            display.set_status("Setup", "error", repr(error))
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

    # -- frames ----------------------------------------------------------------------------------

    @property
    def fixed_frame(self) -> str:
        """The frame in which everything is placed.

        Raises:
            Error: It is set to no name of a frame.
        """
        return self._fixed_frame

    @fixed_frame.setter
    def fixed_frame(self, frame: str) -> None:
        if not isinstance(frame, str) or not frame.strip("/ "):
            raise Error(f"expected the name of a frame, e.g. 'map', got {shown(frame)}")
        frame = frame.lstrip("/")
        if frame != self._fixed_frame:
            self._fixed_frame = frame
            self.fixedFrameChanged.emit()
            self._place_anew()

    @property
    def transforms(self) -> TransformBuffer | None:
        """The robot's transforms; None while there is no node."""
        return None if self._link is None else self._link.buffer

    def frames(self) -> list[str]:
        """Return the names of all frames; of more than 10,000, the first ones."""
        buffer = self.transforms
        return [] if buffer is None else sorted(buffer.frame_names()[:_MAX_FRAMES])

    def look_up(self, frame: str, stamp: int = 0, target: str = "") -> NDArray[np.float64]:
        """Return the pose of a frame in the fixed frame.

        Args:
            frame: The frame.
            stamp: Nanoseconds; 0 for the newest.
            target: Another frame than the fixed one.

        Raises:
            TransformException: It is not known; the text says why.
        """
        target = target or self._fixed_frame
        if frame == target:
            return instance_matrix()
        buffer = self.transforms
        if buffer is None:
            raise LookupException("not connected yet")
        found = buffer.lookup_transform(target, frame, Time(stamp) if stamp else None)
        if not are_drawable(found.translation).all():
            raise _too_far(frame, target)
        return instance_matrix(found.translation, found.rotation)

    def look_up_all(
        self, frames: Sequence[str]
    ) -> tuple[NDArray[np.float64], dict[str, TransformException]]:
        """Return the newest poses of many frames in the fixed frame.

        Returns:
            Their matrices, (n, 4, 4), and for each frame whose pose is not known, why.
        """
        buffer, fixed = self.transforms, self._fixed_frame
        others = [frame for frame in frames if frame != fixed]
        found: dict[str, Any] = (
            dict.fromkeys(others, LookupException("not connected yet"))
            if buffer is None
            else buffer.lookup_newest(fixed, others)
        )
        unknown = {one: why for one, why in found.items() if isinstance(why, TransformException)}
        poses = {**found, **dict.fromkeys([fixed, *unknown], (_ORIGIN, _UPRIGHT))}
        positions = np.array([poses[frame][0] for frame in frames]).reshape(-1, 3)
        rotations = [poses[frame][1] for frame in frames]
        for at in np.flatnonzero(~are_drawable(positions).all(axis=1)).tolist():
            unknown[frames[at]] = _too_far(frames[at], fixed)
            positions[at] = _ORIGIN
        return poses_matrices(positions, rotations), unknown

    def latest_time(self, frame: str) -> int:
        """Return the time of the newest transform between a frame and the fixed one.

        Returns:
            Nanoseconds; 0 where it is valid at any time, or is not known.
        """
        buffer = self.transforms
        if buffer is None or frame == self._fixed_frame:
            return 0
        try:
            return buffer.lookup_transform(self._fixed_frame, frame).stamp.nanoseconds
        except TransformException:
            return 0

    def seconds_without_update(self, frame: str) -> float:
        """Return for how long a frame may have been somewhere else, in seconds.

        That is since the last transform of whichever link between it and the fixed frame was
        received longest ago; 0 without moving links, infinite while the connection is lost. The
        time for which a simulation is paused does not count.
        """
        session = self._session
        if frame in ("", self._fixed_frame):
            return 0.0
        if session is None or session.state != "connected":
            return math.inf
        buffer = self.transforms
        if buffer is None:
            return 0.0
        return min(buffer.silence(self._fixed_frame, frame), self.seconds_running())

    def seconds_running(self) -> float:
        """Return for how long the robot's time runs, since a simulation was last paused."""
        return time.monotonic() - self._paused_at

    def _watch_time(self) -> None:
        node, now = self.node, time.monotonic()
        if node is None or not node.clock.is_simulated:
            self._time_changed_at = math.inf
        elif self._time_changed_at == math.inf or self._simulated_ns != self.now():
            self._simulated_ns, self._time_changed_at = self.now(), now
        elif now - self._time_changed_at > _PAUSED_S:
            # Not a simulation that is gone.
            with suppress(Error):
                if node.publishers("/clock"):
                    self._paused_at = now

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

    def _check_transforms(self) -> None:
        """Report that none are received, that they are mixed, or that there is no fixed frame."""
        link, buffer, frame = self._link, self.transforms, self._fixed_frame
        problem = "" if link is None else link.problem
        if not problem and buffer is not None and not buffer.has_frame(frame):
            names = buffer.frame_names()
            if names:
                problem = f"the fixed frame [{frame}] does not exist{similar(frame, names)}"
        self._set_problem(problem)

    def load(self, work: Callable[[ResourceRetriever], Any], done: Callable[[Any], None]) -> None:
        """Run a job that takes long, such as reading meshes, in a thread of the scene.

        Not on the session's worker, where the endpoints of the cockpit would wait for it.

        Args:
            work: The job, called with what finds meshes and textures.
            done: Called in the GUI thread with its result, or with the error that it raised; not
                once the scene is gone.
        """
        session, takers = self._session, self._takers
        if session is None:
            done(Error("not connected yet"))
            return
        if self._loader is None:
            self._loader = Dispatcher("rosglass-scene")
            self._cleanup["loader"] = partial(_end_loader, session, self._loader, takers)
        executor, resources, job = self._executor, self._retriever(), object()
        takers[job] = done

        def take(result: Any) -> None:
            if job in takers:
                takers.pop(job)(result)

        ask_later = weak_callback(self._ask_later)

        def run() -> None:
            try:
                result = work(resources)
            except Error as error:
                result = error
            except Exception as error:
                _log.exception("loading failed")
                result = Error(f"internal error: {error!r}")
            executor.post(lambda: take(result))
            if resources.is_waiting:
                executor.post(ask_later)

        self._loader.post(run)

    @property
    def is_loading(self) -> bool:
        """True while files, such as meshes, are being read or wait for it."""
        return bool(self._takers)

    def _ask_later(self) -> None:
        """Ask servers of files again that have not answered, less and less often."""
        if is_alive(self) and not self._ask_timer.isActive():
            self._ask_timer.start(int(self.ask_again_s * 1000))
            self.ask_again_s = min(2 * self.ask_again_s, _MAX_ASK_AGAIN_S)

    @Slot()
    def _ask_again(self) -> None:
        self.load(lambda resources: resources.ask_again(), weak_callback(self._on_asked_again))

    def _on_asked_again(self, uris: list[str] | Error) -> None:
        if is_alive(self) and uris and not isinstance(uris, Error):
            self.ask_again_s = _ASK_AGAIN_S
            for display in self._alive():
                self._call(display, lambda one: one.on_files(uris))

    def _retriever(self) -> ResourceRetriever:
        if not self._resources:
            # Slow to import, and needed after the first frame.
            from rosglass.scene.data.resource_retriever import ResourceRetriever  # noqa: PLC0415

            node = None if self._link is None else self.node
            self._resources.append(ResourceRetriever(node))
        return self._resources[0]

    def now(self) -> int:
        """Return the robot's time in nanoseconds; 0 while there is no node."""
        node = self.node
        return 0 if node is None else node.now().nanoseconds

    def time_s(self) -> float:
        """Return the time in seconds that ends what is shown for a while, as in RViz.

        It is the robot's time where that is simulated, and stands still with it.
        """
        node = self.node
        if node is None or not node.clock.is_simulated:
            return self._steady()
        return node.now().seconds

    # -- following the robot ---------------------------------------------------------------------

    def _wanted(self) -> tuple[Any, ...] | None:
        return None if self.node is None else (self.node,)

    def _create_endpoint(self, wanted: tuple[Any, ...]) -> None:
        session = self._session
        assert session is not None
        link = self._link = TfLink.join(session, wanted[0], "", self)
        watch = self._watch = link.buffer.on_update(
            weak_callback(self._on_transforms), session.executor
        )
        jumps = wanted[0].clock.on_jump(weak_callback(self._on_jump), executor=session.executor)
        # One without a node reaches less.
        resources = self._resources = []

        def leave() -> None:
            for one in resources:
                session.background(one.close)
            jumps.close()
            watch.close()
            link.leave(self)

        self._cleanup["transforms"] = leave
        self._place_anew()

    def _on_closed(self, endpoint: Any) -> None:  # noqa: ARG002 - the base class's signature
        leave = self._cleanup.pop("transforms", None)
        if leave is not None:
            leave()
        self._link = self._watch = None
        self._resources = []

    def _on_transforms(self) -> None:
        if is_alive(self) and not self._timer.isActive():
            wait = self._followed_at + _TRANSFORMS_S - time.monotonic()
            self._timer.start(int(max(wait, 0.0) * 1000))

    @Slot()
    def _follow(self) -> None:
        self._followed_at = time.monotonic()
        self._each(lambda display: display.on_transforms())
        self.placed.emit()

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
        for one in self._resources:
            one.retry()
        self._ask_timer.stop()
        self.ask_again_s = _ASK_AGAIN_S
        self._each(restart)

    def _each(self, job: Callable[[Display], None]) -> None:
        for display in self._alive():
            if display.shown and self._call(display, job):
                display.delete_status("Display")

    def _call(self, display: Display, job: Callable[[Display], None]) -> bool:
        """Return whether a job has not failed; otherwise the display says so, and others go on."""
        try:
            job(display)
        except TransformException as error:
            display.set_status("Transform", "error", str(error))
        except Exception as error:
            _log.exception("%s", display.label)
            display.set_status("Display", "error", repr(error))
        else:
            return True
        return False

    def _alive(self) -> Iterator[Display]:
        return (display for display in self.displays if is_alive(display))


def _checked(display: Any) -> Display:
    if not isinstance(display, Display):
        raise ArgumentError("display", display, "a display, or the name of its type, e.g. 'Grid'")
    return display


def _end_loader(session: Session, loader: Dispatcher, takers: dict[object, Any]) -> None:
    takers.clear()
    # Not in the GUI thread: it waits for the file that is being read.
    session.background(loader.close)


def _too_far(frame: str, target: str) -> TransformException:
    return TransformException(f"[{frame}] is more than 1e18 m away from [{target}]")
