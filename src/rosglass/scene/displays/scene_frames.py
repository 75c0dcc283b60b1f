"""The fixed frame of a scene, and its robot: transforms, time, and files such as meshes."""
# ruff: noqa: N815 - the names of properties and signals are QML's

from __future__ import annotations

import logging
import math
import time
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rosglass.comm.executor import Dispatcher
from rosglass.comm.names import similar
from rosglass.comm.time import Time
from rosglass.errors import Error, LookupException, TransformException
from rosglass.overlay.property_values import shown
from rosglass.qml.elements.element import Element, single_shot
from rosglass.qml.elements.tf_buffer import TfLink
from rosglass.qml.engine.runtime import runtime_of
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtCore, Signal, Slot, is_alive
from rosglass.scene.render.arrays import are_drawable
from rosglass.scene.render.matrices import instance_matrix, poses_matrices
from rosglass.scene.render.scene_tree import Group

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from numpy.typing import NDArray

    from rosglass.comm.clock import Jump
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qml.engine.session import Session
    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.tf import TransformBuffer

__all__ = ["SceneFrames"]

_log = logging.getLogger("rosglass.scene")
#: Frames that are listed.
_MAX_FRAMES = 10_000
_ORIGIN, _UPRIGHT = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
#: Seconds without a change of the robot's time after which a simulation is paused.
_PAUSED_S = 1.0
#: Seconds until servers of files that have not answered are asked again, and at most then.
_ASK_AGAIN_S, _MAX_ASK_AGAIN_S = 10.0, 300.0


class SceneFrames(Element):
    """The fixed frame of a scene, and the transforms, the time and the files of its robot.

    Attributes:
        root: All drawables, in the fixed frame.
        ask_again_s: After how many seconds a robot is asked again for files that it did not send.
        draws_in_software: Whether the processor draws, as far as is known.
        has_tf_publishers: Whether transforms have a publisher.
    """

    fixedFrameChanged = Signal()

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self.root = Group()
        self.draws_in_software = False
        self.has_tf_publishers = True
        #: The retriever of meshes and textures, once something has been loaded.
        self._resources: list[ResourceRetriever] = []
        self._fixed_frame = "map"
        self._link: TfLink | None = None
        self._watch: Any = None
        self._loader: Dispatcher | None = None
        #: The receivers of results of the jobs in its thread, which must not hold displays.
        self._takers: dict[object, Callable[[Any], None]] = {}
        #: The robot's simulated time, when it has changed, and when it last stood still.
        self._simulated_ns = 0
        self._time_changed_at, self._paused_at = math.inf, -math.inf
        super().__init__(parent, runtime)
        self._ask_timer = single_shot(self, self._ask_again)
        self.ask_again_s = _ASK_AGAIN_S

    def _find_runtime(self) -> Runtime | None:
        if self._runtime is None:
            # Made by a view: QML knows the view only.
            view = self.parent()
            self._runtime = runtime_of(view) if view is not None else None
        return self._runtime

    # -- for the scene ---------------------------------------------------------------------------

    def _place_anew(self) -> None:
        """Place everything in another fixed frame."""
        raise NotImplementedError

    def _on_transforms(self) -> None:
        """Follow transforms that were received."""
        raise NotImplementedError

    def _on_jump(self, jump: Jump) -> None:
        """Begin anew after a jump of the robot's time."""
        raise NotImplementedError

    def _on_files(self, uris: Collection[str]) -> None:
        """Read files again whose servers answer now."""
        raise NotImplementedError

    # -- transforms ------------------------------------------------------------------------------

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

    def _check_transforms(self) -> None:
        """Report that none are received, that they are mixed, or that there is no fixed frame."""
        link, buffer, frame = self._link, self.transforms, self._fixed_frame
        problem = "" if link is None else link.problem
        if not problem and buffer is not None and not buffer.has_frame(frame):
            names = buffer.frame_names()
            if names:
                problem = f"the fixed frame [{frame}] does not exist{similar(frame, names)}"
        self._set_problem(problem)

    # -- files and time --------------------------------------------------------------------------

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
            except Exception as error:  # files of robots never end the thread
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
            self._on_files(uris)

    def _retry_files(self) -> None:
        """Fetch files again that could not be fetched, once something needs them."""
        for one in self._resources:
            one.retry()
        self._ask_timer.stop()
        self.ask_again_s = _ASK_AGAIN_S

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


def _end_loader(session: Session, loader: Dispatcher, takers: dict[object, Any]) -> None:
    takers.clear()
    # Not in the GUI thread: it waits for the file that is being read.
    session.background(loader.close)


def _too_far(frame: str, target: str) -> TransformException:
    return TransformException(f"[{frame}] is more than 1e18 m away from [{target}]")
