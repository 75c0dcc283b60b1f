"""The display RobotModel: the links of a robot description, where tf has them."""
# ruff: noqa: N802, N815 - the names of slots and properties are QML's

from __future__ import annotations

import logging
import math
import time
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar, cast

import numpy as np

from rosglass.comm.qos import QoS
from rosglass.errors import Error, UnsupportedError
from rosglass.images.encodings import MAX_PIXELS
from rosglass.qml.elements.element import single_shot
from rosglass.qml.engine.properties import ReadOnly, report
from rosglass.qml.engine.session import weak_callback
from rosglass.qt import QtGui, Signal, Slot, is_alive
from rosglass.scene.configs.rviz_formats import (
    DescriptionSetting,
    TopicSetting,
    read_description,
    write_description,
)
from rosglass.scene.configs.settings import Setting
from rosglass.scene.data.meshes import ending_of, load_mesh_cached
from rosglass.scene.data.resources import check_texture, locate_resource
from rosglass.scene.data.triangles import MAX_TRIANGLES, moved
from rosglass.scene.data.urdf import Box, Capsule, Cylinder, MeshFile, Robot, Sphere, parse_urdf
from rosglass.scene.displays.display import Display, Status
from rosglass.scene.displays.parts import Parts
from rosglass.scene.displays.shapes import AxesShapes
from rosglass.scene.render.drawing import Lines, Mesh
from rosglass.scene.render.mesh_shapes import BOX, CYLINDER, SPHERE, Shape
from rosglass.scene.render.scene_tree import Group, move_items

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping

    from numpy.typing import NDArray

    from rosglass.comm.inbox import Sample
    from rosglass.comm.node import Node
    from rosglass.qml.engine.runtime import Runtime
    from rosglass.qt import QtCore
    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.scene.data.triangles import MeshPart
    from rosglass.scene.data.urdf import Link, Visual
    from rosglass.scene.displays.scene_frames import SceneFrames

__all__ = [
    "DescriptionLoader",
    "DescriptionSource",
    "MeshFiles",
    "RobotModelDisplay",
    "link_drawables",
    "read_texture",
]

_log = logging.getLogger("rosglass.scene")
_T = TypeVar("_T")
#: Seconds between two notes on the meshes that were read.
_PROGRESS_S = 0.1
#: Milliseconds until a parameter that is not there is looked up again.
_RETRY_MS = 2000
#: RViz's colour of what has no material.
_NO_MATERIAL = (1.0, 0.0, 0.0, 1.0)
#: Colour of parts of mesh files without a colour.
_GREY = (0.6, 0.6, 0.6, 1.0)
#: RViz's axes of a link: length and diameter, metres.
_AXES_M, _AXES_WIDTH_M = 0.1, 0.01
#: The trail of a link: colour, width and distance of its points in metres, and how many there are.
_TRAIL_COLOR, _TRAIL_WIDTH_M, _TRAIL_STEP_M, _TRAIL_POINTS = (0.0, 0.5, 0.5, 1.0), 0.01, 0.02, 2000
#: Settings that each link has of its own.
_LINK_DETAILS = (
    Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0),
    Setting("Show Trail", "bool", False, "Show the link's path as a line."),
    Setting("Show Axes", "bool", False, "Show the axes of the link's frame."),
)
#: Status lines of links without a transform, before the rest is counted.
_MAX_LINK_LINES = 10
#: Files without materials of their own.
STL_ENDINGS = (".stl", ".stlb")
_AUTOMATIC, _TOPIC, _FILE, _PARAMETER = "Automatic", "Topic", "File", "Parameter"


class DescriptionSource:
    """Source of a robot description: reads or receives it, and hands its text on.

    Args:
        node: The node.
        kind: ``Topic``, ``File`` or ``Parameter``.
        name: Name of the topic, file or parameter.
        on_text: Called with each text, in any thread.
    """

    def __init__(self, node: Node, kind: str, name: str, on_text: Callable[[str], None]) -> None:
        self._subscription: Any = None
        self._on_text = on_text
        if kind == _TOPIC:
            self._subscription = node.create_subscription(
                name,
                "std_msgs/String",
                qos=QoS.best_available(1),
                raw_callback=self._receive,
            )
        elif kind == _FILE:
            path = locate_resource(name)
            try:
                on_text(path.read_text(encoding="utf-8", errors="replace"))
            except OSError as error:
                raise Error(f"{path} cannot be read: {error.strerror}") from None
        else:
            server = getattr(node, "parameter_server", None)
            if server is None:
                raise UnsupportedError(
                    "descriptions in parameters are ROS 1's; in ROS 2, robot_state_publisher "
                    "publishes /robot_description: set Description Source to Topic"
                )
            on_text(str(server.get(name)))

    def _receive(self, sample: Sample) -> None:
        try:
            self._on_text(sample.message().data)
        except Error:
            # The text says what is wrong with it.
            self._on_text("")

    def close(self) -> None:
        """Stop receiving; safe to call twice."""
        if self._subscription is not None:
            self._subscription.close()


class DescriptionLoader:
    """Reads descriptions in the scene's thread: one at a time, and only the newest waiting one.

    Args:
        read: Called there with the text, its source, a finder of meshes, and a function to call
            with the number of meshes that were read, and that of all.
        on_read: Called in the GUI thread with the text and what `read` returned, or its error.
        on_progress: Called in the GUI thread with the text and these numbers.
    """

    def __init__(
        self,
        read: Callable[[str, str, ResourceRetriever, Callable[[int, int], None]], Any],
        on_read: Callable[[str, Any], None],
        on_progress: Callable[[str, int, int], None] = lambda *_: None,
    ) -> None:
        self._read, self._on_read, self._on_progress = read, on_read, on_progress
        #: The scene that is reading one.
        self._busy: SceneFrames | None = None
        self._next: tuple[str, str] | None = None

    def load(self, scene: SceneFrames, text: str, source: str) -> None:
        """Read a description from a source, for errors."""
        if self._busy is scene:
            self._next = (text, source)
            return
        self._busy = scene
        # Not the scene: its thread must not be the last to hold it.
        executor = None if scene._session is None else scene._executor
        on_progress = self._on_progress

        def progress(done: int, total: int) -> None:
            if executor is not None:
                executor.post(lambda: on_progress(text, done, total))

        scene.load(
            lambda resources: self._read(text, source, resources, progress),
            lambda result: self._on_loaded(scene, text, result),
        )

    def _on_loaded(self, scene: SceneFrames, text: str, result: Any) -> None:
        self._busy = None
        following, self._next = self._next, None
        self._on_read(text, result)
        if following is not None and is_alive(scene):
            self.load(scene, *following)


class _Loaded(NamedTuple):
    """A robot that is ready to be shown.

    Attributes:
        robot: Its description.
        visuals: For each link, what its visuals draw.
        collisions: The same of its collisions.
        problems: Errors of loading, by the name of the mesh.
    """

    robot: Robot
    visuals: dict[str, list[Mesh]]
    collisions: dict[str, list[Mesh]]
    problems: dict[str, str]


def _matrix(*scale: float, along: float = 0.0) -> NDArray[np.float64]:
    matrix = np.diag([*scale, 1.0])
    matrix[2, 3] = along
    return matrix


def read_texture(source: str | bytes, name: str, resources: ResourceRetriever) -> NDArray[np.uint8]:
    """Return the pixels of an image, (h, w, 4).

    Args:
        source: Its URI or path, or its bytes.
        name: Name of the image or its mesh, for errors.
        resources: Reads the file.

    Raises:
        Error: The file is missing, too large, or not an image.
    """
    data = source if isinstance(source, bytes) else resources.read(source)
    check_texture(data, name)
    image = QtGui.QImage.fromData(data)
    if image.isNull():
        raise Error(f"{name}: this is not an image that Qt can read")
    image = image.convertToFormat(QtGui.QImage.Format.Format_RGBX8888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    whole: NDArray[np.uint8] = rows[:, : 4 * image.width()].copy()
    return whole.reshape(image.height(), image.width(), 4)


class MeshFiles:
    """Meshes and textures, each read once however often it is used; not for the GUI thread.

    Args:
        resources: Reads the files.
    """

    def __init__(self, resources: ResourceRetriever) -> None:
        self._resources = resources
        #: The meshes, or the errors of reading them.
        self._meshes: dict[Any, list[tuple[MeshPart, Shape]] | Exception] = {}
        self._textures: dict[str | bytes, NDArray[np.uint8] | Exception] = {}
        #: The drawables of each texture.
        self._painted: dict[str | bytes, list[Mesh]] = {}
        self._triangles = self._pixels = 0
        self._halves = False

    def mesh(
        self, uri: str, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    ) -> list[tuple[MeshPart, Shape]]:
        """Return the parts of a mesh, each with its shape.

        Raises:
            Error: It cannot be read, or has more triangles than are left of 10 million for all.
        """
        return _once(self._meshes, (uri, scale), lambda: self._read_mesh(uri, scale))

    def _read_mesh(
        self, uri: str, scale: tuple[float, float, float]
    ) -> list[tuple[MeshPart, Shape]]:
        parts = load_mesh_cached(self._resources.find(uri), uri, self._resources.read)
        triangles = sum(part.triangles for part in parts)
        if self._triangles + triangles > MAX_TRIANGLES:
            raise Error(
                f"{uri}: with its {triangles} triangles, all meshes have more than "
                f"{MAX_TRIANGLES}; reduce them"
            )
        self._triangles += triangles
        return [(part, _shape_of(part, scale)) for part in parts]

    def paint(self, mesh: Mesh, source: str | bytes, name: str) -> None:
        """Give a drawable a texture; see :func:`read_texture`.

        All textures have at most 2^26 pixels: the largest ones are halved until they fit.

        Raises:
            Error: It cannot be read.
        """
        pixels = _once(self._textures, source, lambda: self._read_texture(source, name))
        self._painted.setdefault(source, []).append(mesh)
        mesh.set_texture(pixels)
        if self._pixels > MAX_PIXELS:
            self._halve_textures()

    def _read_texture(self, source: str | bytes, name: str) -> NDArray[np.uint8]:
        found = read_texture(source, name, self._resources)
        self._pixels += _pixels_of(found)
        return found

    def _halve_textures(self) -> None:
        if not self._halves:
            self._halves = True
            _log.warning(
                "the textures have more than %d pixels; the largest are shown with half of their "
                "resolution", MAX_PIXELS,
            )  # fmt: skip
        while self._pixels > MAX_PIXELS:
            source = max(self._painted, key=lambda key: _pixels_of(self._textures[key]))
            found = self._textures[source]
            assert not isinstance(found, Exception)
            smaller = _halved(found)
            self._pixels -= _pixels_of(found) - _pixels_of(smaller)
            self._textures[source] = smaller
            for mesh in self._painted[source]:
                mesh.set_texture(smaller)


def _pixels_of(texture: NDArray[np.uint8] | Exception) -> int:
    return 0 if isinstance(texture, Exception) else texture.shape[0] * texture.shape[1]


def _halved(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return an image with half the width and height, each pixel the mean of four."""
    for axis in (0, 1):
        even = pixels.shape[axis] // 2 * 2
        if even:
            first, second = (
                np.take(pixels, np.arange(start, even, 2), axis).astype(np.uint16)
                for start in (0, 1)
            )
            pixels = ((first + second) // 2).astype(np.uint8)
    return np.ascontiguousarray(pixels)


def _once(known: dict[Any, _T | Exception], key: Any, read: Callable[[], _T]) -> _T:
    """Return the value read under a key, or raise the error of the first attempt."""
    if key not in known:
        try:
            known[key] = read()
        except (Error, OSError) as error:
            known[key] = error
    found = known[key]
    if isinstance(found, Exception):
        raise found
    return found


def _shape_of(part: MeshPart, scale: tuple[float, float, float]) -> Shape:
    scaled = part if scale == (1.0, 1.0, 1.0) else moved(part, _matrix(*scale))
    return Shape(scaled.positions, scaled.normals, scaled.indices, uv=part.uv, one_sided=True)


def link_drawables(visual: Visual, problems: dict[str, str], files: MeshFiles) -> list[Mesh]:
    """Return the drawables of a link's visual or collision, in the link's frame.

    Reads mesh files: not for the GUI thread.

    Args:
        visual: The visual.
        problems: Receives errors of loading, by the name of the file.
        files: Reads meshes and textures.
    """
    geometry = visual.geometry
    material = visual.material
    own = material.color if material is not None else _NO_MATERIAL
    simple: list[tuple[Shape, NDArray[np.float64]]] = []
    if isinstance(geometry, Box):
        simple.append((BOX, _matrix(*geometry.size)))
    elif isinstance(geometry, Sphere):
        simple.append((SPHERE, _matrix(*[2 * geometry.radius] * 3)))
    elif isinstance(geometry, (Cylinder, Capsule)):
        wide = 2 * geometry.radius
        simple.append((CYLINDER, _matrix(wide, wide, geometry.length)))
        if isinstance(geometry, Capsule):
            simple += [
                (SPHERE, _matrix(wide, wide, wide, along=side * geometry.length / 2))
                for side in (-1, 1)
            ]
    made = []
    for shape, local in simple:
        mesh = Mesh(shape, own)
        mesh.set_instances((visual.origin @ local)[np.newaxis])
        made.append(mesh)
    if isinstance(geometry, MeshFile):
        made += _mesh_drawables(visual, geometry, own, problems, files)
    elif material is not None and material.texture:
        try:
            for mesh in made:
                files.paint(mesh, material.texture, material.texture)
                # RViz uses one or the other.
                mesh.set_look(color=(1.0, 1.0, 1.0, 1.0))
        except (Error, OSError) as error:
            problems[material.texture] = str(error)
    return made


def _mesh_drawables(
    visual: Visual,
    geometry: MeshFile,
    own: tuple[float, float, float, float],
    problems: dict[str, str],
    files: MeshFiles,
) -> list[Mesh]:
    try:
        parts = files.mesh(geometry.uri, geometry.scale)
    except (Error, OSError) as error:
        problems[geometry.uri] = str(error)
        return []
    is_stl = ending_of(geometry.uri) in STL_ENDINGS
    made = []
    for part, shape in parts:
        # In RViz, only STL files have no materials of their own.
        mesh = Mesh(shape, own if is_stl else material_of(part))
        mesh.set_instances(visual.origin[np.newaxis])
        if part.texture is not None:
            try:
                files.paint(mesh, part.texture, geometry.uri)
            except (Error, OSError) as error:
                problems[geometry.uri] = str(error)
        made.append(mesh)
    return made


def material_of(part: MeshPart) -> tuple[float, float, float, float]:
    """Return the colour of a part of a mesh file that has materials: opaque, as in RViz."""
    r, g, b, _ = part.color or _GREY
    return (r, g, b, 1.0)


def _load(
    text: str, source: str, resources: ResourceRetriever, progress: Callable[[int, int], None]
) -> _Loaded:
    """Read a description and its meshes; takes seconds for large ones."""
    if not text.strip():
        raise Error(f"{source}: the robot description is empty")
    robot = parse_urdf(text, source)
    problems: dict[str, str] = {}
    files = MeshFiles(resources)
    total = len({uri for link in robot.links.values() for uri in _mesh_uris(link)})
    read: set[str] = set()
    said_at = -math.inf
    visuals, collisions = {}, {}
    for name, link in robot.links.items():
        visuals[name] = [m for v in link.visuals for m in link_drawables(v, problems, files)]
        collisions[name] = [m for v in link.collisions for m in link_drawables(v, problems, files)]
        read.update(_mesh_uris(link))
        if read and time.monotonic() - said_at > _PROGRESS_S:
            said_at = time.monotonic()
            progress(len(read), total)
    return _Loaded(robot, visuals, collisions, problems)


def _mesh_uris(link: Link) -> Iterator[str]:
    for one in (*link.visuals, *link.collisions):
        if isinstance(one.geometry, MeshFile):
            yield one.geometry.uri


class _Link:
    """A link of the robot that is shown."""

    def __init__(self, visuals: list[Mesh], collisions: list[Mesh], owner: Any) -> None:
        self.visual, self.collision = Group(*visuals), Group(*collisions)
        self.has_shape = bool(visuals or collisions)
        self.root = Group(self.visual, self.collision)
        self.root.visible = False
        #: Made when they are shown for the first time; the trail is in the fixed frame.
        self.axes: AxesShapes | None = None
        self.trail: Lines | None = None
        self._way: deque[NDArray[np.float64]] = deque(maxlen=_TRAIL_POINTS)
        self._end = np.zeros(3)
        self._owner = owner
        for mesh in (*visuals, *collisions):
            mesh.owner = owner

    def set_alpha(self, alpha: float) -> None:
        """Set the opacity of its shapes."""
        self.visual.alpha = self.collision.alpha = alpha

    def show_axes(self, shown: bool) -> None:
        """Show the axes of its frame, or not."""
        if shown and self.axes is None:
            self.axes = AxesShapes(self._owner)
            self.axes.set_axes(np.eye(4)[np.newaxis], _AXES_M, _AXES_WIDTH_M)
            self.root.add(self.axes)
        if self.axes is not None:
            self.axes.visible = shown

    def show_trail(self, shown: bool, group: Group) -> None:
        """Begin a trail in a group of the fixed frame, or remove it."""
        if shown == (self.trail is not None):
            return
        if self.trail is not None:
            self.trail.remove()
        self.clear_trail()
        self.trail = Lines(_TRAIL_WIDTH_M, in_metres=True) if shown else None
        if self.trail is not None:
            group.add(self.trail)

    def clear_trail(self) -> None:
        """Forget where it was."""
        self._way.clear()

    def extend_trail(self) -> None:
        """Draw the trail up to where the link is."""
        if self.trail is None:
            return
        at = self.root.pose[:3, 3]
        if not self._way or np.linalg.norm(at - self._way[-1]) >= _TRAIL_STEP_M:
            self._way.append(at)
        elif self.trail.count and (at == self._end).all():
            return
        self._end = at
        self.trail.set_strip([*self._way, at], _TRAIL_COLOR)


class _Part:
    """The result of picking a link.

    Attributes:
        display: The display.
        name: Name of the link.
    """

    def __init__(self, display: RobotModelDisplay, name: str) -> None:
        self.display, self.name = display, name

    def __repr__(self) -> str:
        return f"link {self.name}"

    def describe(self) -> list[tuple[str, str]]:
        """Return the lines of the Selection panel."""
        display = self.display
        # Its frame, not the middle of its meshes.
        place = display.describe_frame(*display._frames_of([self.name]))
        return [*place, ("Robot", display.robotName)]


class RobotModelDisplay(Display):
    """A robot by its description (URDF). See its page in ``docs/scene.md``."""

    TYPE = "RobotModel"

    visualEnabled = Setting("Visual Enabled", "bool", True, "Show visuals.")
    collisionEnabled = Setting("Collision Enabled", "bool", False, "Show collisions.")
    updateInterval = Setting("Update Interval", "float", 0.0, "Seconds; 0 for every change.", min=0)
    alpha = Setting("Alpha", "float", 1.0, "Opacity.", min=0.0, max=1.0)
    descriptionSource = Setting(
        "Description Source", "enum", _AUTOMATIC,
        "Source of the description; automatic is the parameter in ROS 1, the topic in ROS 2.",
        choices=[_AUTOMATIC, _TOPIC, _FILE, _PARAMETER], then="_on_source",
    )  # fmt: skip
    descriptionTopic = Setting(
        "Description Topic", "topic", "/robot_description", "Topic of type std_msgs/String.",
        then="_on_source", shown_if={"used_source": _TOPIC},
    )  # fmt: skip
    descriptionFile = Setting(
        "Description File", "path", "", "Path or package:// URI of a URDF file.", then="_on_source",
        shown_if={"used_source": _FILE},
    )  # fmt: skip
    robotDescription = Setting(
        "Robot Description", "string", "robot_description", "Name of the parameter in ROS 1.",
        then="_on_source", shown_if={"used_source": _PARAMETER},
    )  # fmt: skip
    tfPrefix = Setting("TF Prefix", "string", "", "Prefix of the links' frames.")
    allLinksEnabled = Setting(
        "Links/All Links Enabled", "bool", True, "Show or hide all links.",
        then="_on_all_links_enabled",
    )  # fmt: skip

    linksChanged = Signal()
    robotChanged = Signal()
    #: Names of the links.
    links: ReadOnly[list[str]] = ReadOnly(cast("type[list[str]]", "QStringList"), [])
    robotName = ReadOnly(str, "", notify="robotChanged")

    def __init__(
        self, parent: QtCore.QObject | None = None, runtime: Runtime | None = None
    ) -> None:
        self._bodies: dict[str, _Link] = {}
        #: The last poses of the links, (n, 4, 4), and the state of the transforms then.
        self._poses = np.zeros((0, 4, 4))
        self._rest: object = None
        self._body, self._trails = Group(), Group()
        self._root_link = ""
        self._text: str | None = None
        self._source = ""
        #: Why meshes and textures of the robot that is shown could not be loaded.
        self._missing: list[str] = []
        self._loader = DescriptionLoader(
            _load, weak_callback(self._show), weak_callback(self._show_progress)
        )
        #: Status lines about the description that is shown.
        self._loaded_lines: dict[str, Status] = {}
        self._followed_at = -math.inf
        super().__init__(parent, runtime)
        self.parts: Parts = Parts(
            "Links",
            lambda: self.links,
            self._restyle,
            default=lambda: self.allLinksEnabled,
            can_switch=lambda name: name in self._bodies and self._bodies[name].has_shape,
            details=_LINK_DETAILS,
            describe=lambda name: self.describe_frame(*self._frames_of([name])),
            as_mapping=True,
        )
        self._again = single_shot(self, self._create_again)

    # -- the description -------------------------------------------------------------------------

    def _on_source(self) -> None:
        self._text = None
        self._clear()
        self._schedule()

    @property
    def used_source(self) -> str:
        """The source of the description: ``Topic``, ``File`` or ``Parameter``."""
        if self.descriptionSource != _AUTOMATIC:
            return str(self.descriptionSource)
        return _PARAMETER if hasattr(self.node, "parameter_server") else _TOPIC

    def _find_source(self) -> tuple[str, str]:
        kind = self.used_source
        name = {
            _TOPIC: self.descriptionTopic,
            _FILE: self.descriptionFile,
            _PARAMETER: self.robotDescription,
        }[kind]
        return kind, name

    def _wanted(self) -> tuple[Any, ...] | None:
        node = self.node
        if node is None or self.scene is None or not self.shown:
            return None
        kind, name = self._find_source()
        return (node, kind, name) if name else None

    def _factory(self, *wanted: Any) -> Callable[[], Any]:
        node, kind, name = wanted
        executor, take = self._executor, weak_callback(self._take_text)
        # One that is shown already is not loaded again.
        waiting = Status("warn", f"waiting for the description: {kind.lower()} {name}")
        for line, status in (self._loaded_lines or {"URDF": waiting}).items():
            self.set_status(line, *status)

        def on_text(text: str) -> None:
            executor.post(lambda: take(text, name))

        return lambda: DescriptionSource(node, kind, name, on_text)

    def _on_create_failed(self, error: Error) -> None:
        self.set_status("URDF", "error", str(error))
        if not isinstance(error, UnsupportedError):
            self._again.start(_RETRY_MS)

    def _take_text(self, text: str, source: str) -> None:
        if not is_alive(self) or self.scene is None or text == self._text:
            return
        self._text, self._source = text, source
        self.set_status("URDF", "warn", "loading the robot and its meshes")
        self._loader.load(self.scene, text, source)

    def _show_progress(self, text: str, done: int, total: int) -> None:
        if is_alive(self) and text == self._text:
            self.set_status("URDF", "warn", f"loading {done} of {total} meshes")

    def _show(self, text: str, result: _Loaded | Error) -> None:
        if not is_alive(self) or text != self._text:
            return
        self._clear()
        if isinstance(result, Error):
            self._loaded_lines = {"URDF": Status("error", str(result))}
            self.set_status("URDF", "error", str(result))
            return
        for name in result.robot.links:
            part = _Part(self, name)
            link = self._bodies[name] = _Link(result.visuals[name], result.collisions[name], part)
            self._body.add(link.root)
        self._root_link = result.robot.root
        self._missing = list(result.problems.values())
        report(self, links=sorted(self._bodies), robotName=result.robot.name)
        self.check_parts()
        lines = {"URDF": Status("ok", "URDF parsed OK")}
        for number, warning in enumerate(result.robot.warnings[:_MAX_LINK_LINES]):
            lines[f"URDF {number + 1}"] = Status("warn", warning)
        for name, problem in list(result.problems.items())[:_MAX_LINK_LINES]:
            line = f"Mesh {name.rpartition('/')[2]}"
            lines[f"Mesh {name}" if line in lines else line] = Status("error", problem)
        if len(result.problems) > _MAX_LINK_LINES:
            text = f"{len(result.problems)} meshes and textures could not be loaded"
            lines["Meshes"] = Status("error", text)
        self._loaded_lines = lines
        for line, status in lines.items():
            self.set_status(line, *status)
        self._restyle()

    def _clear(self) -> None:
        self._bodies.clear()
        self._poses, self._rest = np.zeros((0, 4, 4)), None
        self._body.clear()
        self._trails.clear()
        self._loaded_lines = {}
        self._missing = []
        self.root.add(self._body, self._trails)
        self.clear_status()
        report(self, links=[], robotName="")

    def reset(self) -> None:
        """Begin the trails anew; load the robot again if a mesh is missing: it may be there now."""
        self._clear_trails()
        if self._missing:
            self._text = None

    def on_files(self, uris: Collection[str]) -> None:
        """Load the robot again, if it has a mesh or texture that was missing."""
        text, is_missing = self._text, any(uri in one for one in self._missing for uri in uris)
        if text is not None and is_missing:
            self._text = None
            if self.shown:  # otherwise it is received again once it is
                self._take_text(text, self._source)

    def followed_frames(self) -> list[str]:
        """Return the frames of the links that are shown, the root link's first."""
        shown = [
            name for name, link in self._bodies.items() if link.root.visible and link.has_shape
        ]
        shown.sort(key=lambda name: name != self._root_link)
        return self._frames_of(shown)

    def _frames_of(self, links: Iterable[str]) -> list[str]:
        prefix = self.tfPrefix.strip("/")
        return [f"{prefix}/{link}" if prefix else link for link in links]

    # -- the links -------------------------------------------------------------------------------

    @Slot(str, bool)
    def setLinkEnabled(self, link: str, enabled: bool) -> None:
        """Show or hide a link."""
        self.switch_part(link, enabled)

    def _on_all_links_enabled(self) -> None:
        self.parts.follow_default()

    def _restyle(self) -> None:
        self._body.alpha = self.alpha
        for name, link in self._bodies.items():
            link.visual.visible = self.visualEnabled
            link.collision.visible = self.collisionEnabled
            link.set_alpha(self.parts.get(name, "Alpha"))
            link.show_axes(self.parts.get(name, "Show Axes"))
            link.show_trail(self.parts.get(name, "Show Trail"), self._trails)
        self._follow()

    def on_transforms(self) -> None:
        """Move the links."""
        if self._rest is not None and self._rest == self._find_rest():
            return
        if time.monotonic() - self._followed_at >= self.updateInterval:
            self._follow()

    def _find_rest(self) -> object:
        buffer = None if self.scene is None else self.scene.transforms
        return None if buffer is None else buffer.rest()

    def on_fixed_frame(self) -> None:
        """Place the links in the new fixed frame."""
        self._clear_trails()
        self._follow()

    def _clear_trails(self) -> None:
        for link in self._bodies.values():
            link.clear_trail()

    def _follow(self) -> None:
        scene = self.scene
        if scene is None or not self._bodies or not self.shown:
            return
        self._rest, self._followed_at = self._find_rest(), time.monotonic()
        frames = self._frames_of(self._bodies)
        poses, unknown = scene.look_up_all(frames)
        before, self._poses = self._poses, poses
        # Links are moved one by one, which takes longer than finding out which have moved.
        is_same = poses.shape == before.shape
        moved = (poses != before).any(axis=(1, 2)) if is_same else np.ones(len(poses), bool)
        if unknown:
            lost = [frame in unknown for frame in frames]
            poses[lost] = np.nan  # wherever they are found again, they have moved
            moved[lost] = False
        links = list(self._bodies.values())
        move_items([links[at].root for at in np.flatnonzero(moved)], poses[moved])
        missing: list[tuple[str, str]] = []
        for (name, link), frame in zip(self._bodies.items(), frames, strict=True):
            if frame in unknown:
                missing.append((name, str(unknown[frame])))
                link.root.visible = False
                continue
            link.extend_trail()
            link.root.visible = self.parts.is_enabled(name) or not link.has_shape
        self._report_missing(missing)

    def _report_missing(self, missing: list[tuple[str, str]]) -> None:
        shown = {f"Link {name}": reason for name, reason in missing[:_MAX_LINK_LINES]}
        for line in list(self.status_lines):
            if line.startswith("Link ") and line not in shown:
                self.delete_status(line)
        for line, reason in shown.items():
            self.set_status(line, "error", f"no transform: {reason}")
        if len(missing) > _MAX_LINK_LINES:
            text = f"{len(missing)} of {len(self._bodies)} links have no transform"
            self.set_status("Links", "error", text)
        else:
            self.delete_status("Links")

    # -- files -----------------------------------------------------------------------------------

    def load_settings(self, saved: Mapping[str, Any]) -> list[str]:
        """Apply the settings in a file of either RViz, and the visibility of links."""
        ours = {
            key: value
            for key, value in saved.items()
            if key not in ("Description Topic", "Description Source", "Robot Description")
        }
        refused = super().load_settings(ours)
        refused += self.parts.load(saved)
        if not {"Description Source", "Description Topic", "Robot Description"} & set(saved):
            return refused
        try:
            found = read_description(saved)
            path = {"topic": "Description Topic", "file": "Description File"}
            self.set(path.get(found.source, "Robot Description"), found.name)
            # A file of RViz 1 names the parameter, which robots with ROS 2 do not have.
            source = found.source.capitalize()
            self.descriptionSource = _AUTOMATIC if source == _PARAMETER else source
        except Error as error:
            refused.append(str(error))
        return refused

    def save_settings(self, older: Mapping[str, Any] | None = None, ros: int = 2) -> dict[str, Any]:
        """Return the settings for a file of one RViz, with the links that are shown."""
        old = dict(older or {})
        kept = super().save_settings(old, ros)
        for key in (
            "Description Topic",
            "Description Source",
            "Description File",
            "Robot Description",
        ):
            if key in old:
                kept[key] = old[key]
            else:
                kept.pop(key, None)
        source = self.descriptionSource
        if source == _AUTOMATIC:
            source = _PARAMETER if ros == 1 else _TOPIC
        if source == _FILE:
            description = DescriptionSetting("file", self.descriptionFile)
        elif source == _TOPIC:
            topic = TopicSetting(self.descriptionTopic)
            description = DescriptionSetting("topic", self.descriptionTopic, topic)
        else:
            description = DescriptionSetting("parameter", self.robotDescription)
        try:
            write_description(kept, description, ros)
        except Error:
            # The other RViz has no such source: at least it is not lost.
            kept.setdefault(
                "Robot Description" if ros == 1 else "Description File", description.name
            )
        self.parts.save(kept)
        return kept
