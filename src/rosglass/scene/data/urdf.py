"""Robot descriptions: URDF text to links, joints, geometry and materials.

Read as RViz does where URDF leaves it open; what is broken in a single visual becomes a warning,
and the rest of the robot is read all the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

import numpy as np

from rosglass.comm.names import similar
from rosglass.comm.xml_reader import XmlElement, XmlError, read_xml
from rosglass.errors import ArgumentError, Error

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    Matrix: TypeAlias = NDArray[np.float64]

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "Joint",
    "JointLimits",
    "Link",
    "Material",
    "MeshFile",
    "Mimic",
    "Robot",
    "Sphere",
    "UrdfError",
    "Visual",
    "parse_urdf",
]

_MAX_TEXT_BYTES = 20 << 20
_MAX_LINKS = 10_000
_MAX_WARNINGS = 100

#: Joint types of URDF that move by one number; the others are fixed, floating and planar.
_MOVING = frozenset({"revolute", "continuous", "prismatic"})
_TYPES = (*sorted(_MOVING), "fixed", "floating", "planar")


class UrdfError(Error):
    """A robot description can't be used; the message has its source and line."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box around the origin.

    Attributes:
        size: Lengths of the edges along x, y and z in metres.
    """

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder around the z axis, with the origin in its middle; lengths in metres."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """A cylinder around the z axis with half spheres added to both ends; lengths in metres.

    Attributes:
        length: Length of the cylinder, without the half spheres.
    """

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere around the origin; the radius in metres."""

    radius: float


@dataclass(frozen=True, slots=True)
class MeshFile:
    """A mesh in a file.

    Attributes:
        uri: ``package://name/path``, ``file:///path`` or a path, as the description has it.
        scale: Factors along x, y and z; negative ones mirror.
    """

    uri: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Geometry: TypeAlias = Box | Cylinder | Capsule | Sphere | MeshFile


@dataclass(frozen=True, slots=True)
class Material:
    """Colour and texture of a visual.

    Attributes:
        name: Its name; empty for one without a name.
        color: Red, green, blue and opacity, 0 to 1.
        texture: URI of an image; empty without one.
    """

    name: str
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    texture: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Visual:
    """A ``<visual>`` or ``<collision>`` of a link.

    Attributes:
        geometry: Its shape.
        origin: Pose of the shape in the link, a 4x4 matrix.
        material: As RViz resolves it: its own, or that of the last visual before it in the link;
            None where the link has none, for which RViz draws red. A mesh file's own materials
            take precedence.
        name: Its name; empty for none.
    """

    geometry: Geometry
    origin: Matrix
    material: Material | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A link: a rigid part of the robot, and the tf frame of its name."""

    name: str
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Visual, ...] = ()


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of a joint, in rad, m, Nm, N, rad/s and m/s by its type."""

    lower: float = 0.0
    upper: float = 0.0
    effort: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint's position as that of another joint, times `multiplier`, plus `offset`."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint between two links.

    Attributes:
        name: Its name.
        type: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``floating`` or ``planar``.
        parent: Name of the parent link.
        child: Name of the child link.
        origin: Pose of the child link in the parent link at position 0, a 4x4 matrix.
        axis: Unit vector in the child link, or three zeros if the description says so.
        limits: Its limits; None if the description has none.
        mimic: The joint that it follows; None if it moves on its own.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Matrix
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    limits: JointLimits | None = None
    mimic: Mimic | None = None

    def motion(self, position: float) -> Matrix:
        """Return the pose of the child link in the parent link, a 4x4 matrix.

        Args:
            position: In rad for revolute and continuous joints, in m for prismatic ones. Other
                types have more or fewer than one number; they stay at their origin.

        Raises:
            ArgumentError: The position is not a finite number.
        """
        position = _finite(f"position of joint {self.name}", position)
        moved = np.eye(4)
        if self.type == "prismatic":
            moved[:3, 3] = np.multiply(self.axis, position)
        elif self.type in _MOVING:
            moved[:3, :3] = _rotation(self.axis, position)
        return self.origin @ moved


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A robot description.

    Attributes:
        name: The robot's name.
        links: The links by name.
        joints: The joints by name.
        root: Name of the link that is not the child of a joint.
        warnings: Broken elements that were left out, each with source and line.
        tree: The joints, each after the joint that moves its parent link.
    """

    name: str
    links: dict[str, Link]
    joints: dict[str, Joint]
    root: str
    warnings: tuple[str, ...] = ()
    tree: tuple[Joint, ...] = field(default=(), repr=False)

    def poses(self, joint_positions: Mapping[str, float] | None = None) -> dict[str, Matrix]:
        """Return the pose of every link in the root link, 4x4 matrices.

        Args:
            joint_positions: Positions by joint, in rad and m; joints that are not in it are at 0,
                and names of other robots' joints are ignored. Joints that mimic another one follow
                it, whatever is given for them.

        Raises:
            ArgumentError: A position is not a finite number.
        """
        positions = self.positions(joint_positions or {})
        poses = {self.root: np.eye(4)}
        for joint in self.tree:
            poses[joint.child] = poses[joint.parent] @ joint.motion(positions[joint.name])
        return poses

    def positions(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return the positions of all joints in rad and m; those that mimic others follow them.

        Args:
            given: Positions by joint; others are at 0.

        Raises:
            ArgumentError: A position is not a finite number.
        """
        positions: dict[str, float] = {}
        for joint in self.joints.values():
            followers = []
            while joint.name not in positions and joint.mimic is not None:
                followers.append(joint)
                joint = self.joints[joint.mimic.joint]  # noqa: PLW2901 - the parser breaks loops
            if joint.name not in positions:
                name = f"position of joint {joint.name}"
                positions[joint.name] = _finite(name, given.get(joint.name, 0))
            for follower in reversed(followers):
                mimic = follower.mimic
                assert mimic is not None
                positions[follower.name] = mimic.multiplier * positions[mimic.joint] + mimic.offset
        return positions


def parse_urdf(text: str | bytes, source: str = "robot_description") -> Robot:
    """Parse a robot description.

    Args:
        text: The URDF, with xacro's macros expanded.
        source: File, parameter or topic that it is from, for messages.

    Raises:
        UrdfError: The text is not a URDF, or its links do not form a tree; the error names the line
            and the fix.
        ArgumentError: The text is neither a string nor bytes.
    """
    if not isinstance(text, (str, bytes)):
        raise ArgumentError(source, text, "the text of a URDF")
    warnings: list[str] = []
    try:
        root = read_xml(text, source, _MAX_TEXT_BYTES, warnings.append)
    except XmlError as error:
        raise UrdfError(str(error)) from None
    return _Parser(source, warnings).robot(root)


class _Broken(Exception):  # noqa: N818 - never leaves this file
    """An element is broken: an error or a warning, as the element above it decides."""

    def __init__(self, element: XmlElement, reason: str) -> None:
        super().__init__(reason)
        self.line, self.reason = element.line, reason


class _Parser:
    def __init__(self, source: str, warnings: list[str]) -> None:
        self._source, self._warnings = source, warnings
        #: Advice about tags of xacro, for errors that they may have caused.
        self._hint = ""
        self._materials: dict[str, Material] = {}
        #: The elements of links and joints by name.
        self._link_elements: dict[str, XmlElement] = {}
        self._joint_elements: dict[str, XmlElement] = {}

    def robot(self, root: XmlElement) -> Robot:
        self._check_root(root)
        try:
            links = self._links(root)
            joints = self._joints(root, links)
            self._check_mimics(joints)
            top, tree = self._tree(links, joints)
        except _Broken as broken:
            text = f"{self._source}:{broken.line}: {broken.reason}{self._hint}"
            raise UrdfError(text) from None
        name = root.get("name", "")
        if not name:
            self._warn(root, "<robot> has no name; give it one: <robot name=...>")
        extra = len(self._warnings) - _MAX_WARNINGS
        if extra > 0:
            self._warnings[_MAX_WARNINGS:] = [f"{self._source}: {extra} more warnings"]
        return Robot(name, links, joints, top, tuple(self._warnings), tree)

    def _check_root(self, root: XmlElement) -> None:
        where = f"{self._source}:{root.line}"
        if root.tag == "sdf":
            raise UrdfError(f"{where}: this is SDF, of Gazebo; expected URDF: <robot name=...>")
        if root.tag != "robot":
            raise UrdfError(f"{where}: expected <robot name=...>, got <{root.tag}>")
        left = [element for element in root.iter() if element.tag.startswith("xacro:")]
        if left:
            tags = ", ".join(dict.fromkeys(f"<{element.tag}>" for element in left[:_MAX_WARNINGS]))
            line = getattr(left[0], "line", 0)
            advice = "expand the file first: xacro FILE.xacro > FILE.urdf"
            self._warnings.append(
                f"{self._source}:{line}: {tags} is xacro, not URDF, and is left out; {advice}"
            )
            self._hint = f"; {tags} in line {line} is xacro: {advice}"

    # -- links ------------------------------------------------------------------------------------

    def _links(self, root: XmlElement) -> dict[str, Link]:
        elements = _children(root, "link")
        if not elements:
            raise _Broken(root, "the robot has no <link>; expected at least one")
        if len(elements) > _MAX_LINKS:
            raise _Broken(root, f"the robot has {len(elements)} links; the limit is {_MAX_LINKS}")
        self._read_materials(root, elements)
        for element in elements:
            _register(element, self._link_elements)
        return {name: self._link(element, name) for name, element in self._link_elements.items()}

    def _link(self, element: XmlElement, name: str) -> Link:
        visuals = []
        latest = None
        for child in _children(element, "visual"):
            visual = self._visual(child, f"visual of link {name!r}")
            if visual is not None:
                latest = visual.material or latest
                visuals.append(visual if visual.material else replace(visual, material=latest))
        # RViz draws the collision geometry with the link's last material.
        collisions = [
            replace(found, material=latest)
            for child in _children(element, "collision")
            if (found := self._visual(child, f"collision of link {name!r}")) is not None
        ]
        return Link(name, tuple(visuals), tuple(collisions))

    def _visual(self, element: XmlElement, where: str) -> Visual | None:
        """Read a visual; warn and return None if it can't be drawn."""
        try:
            geometry = _child(element, "geometry")
            if geometry is None:
                raise _Broken(element, "it has no <geometry>")
            return Visual(
                _geometry(geometry),
                _origin(element),
                self._material(element, where),
                element.get("name", ""),
            )
        except _Broken as broken:
            self._warnings.append(
                f"{self._source}:{broken.line}: {where}: {broken.reason}; it is not drawn"
            )
            return None

    # -- materials --------------------------------------------------------------------------------

    def _read_materials(self, root: XmlElement, links: Iterable[XmlElement]) -> None:
        """Collect the named materials: the robot's own, then those defined in visuals."""
        for element in _children(root, "material"):
            try:
                material = self._defined(element, _name(element))
            except _Broken as broken:
                self._warn(element, f"material: {broken.reason}; it is left out")
                continue
            if material is None:
                self._warn(element, f"material {element.get('name')!r} has no colour or texture")
            elif self._materials.setdefault(material.name, material) != material:
                self._warn(
                    element, f"material {material.name!r} is defined twice; the first one is used"
                )
        for link in links:
            for visual in _children(link, "visual"):
                for element in _children(visual, "material"):
                    name = element.get("name", "")
                    if name and name not in self._materials:
                        try:
                            material = self._defined(element, name)
                        except _Broken:
                            continue  # _material() warns of it, with the link's name
                        if material is not None:
                            self._materials[name] = material

    def _material(self, visual: XmlElement, where: str) -> Material | None:
        element = _child(visual, "material")
        if element is None:
            return None
        name = element.get("name", "")
        if name in self._materials:
            return self._materials[name]
        try:
            material = self._defined(element, name)
        except _Broken as broken:
            self._warn(element, f"{where}: {broken.reason}; the default colour is used")
            return None
        if material is None:
            hint = "" if len(self._warnings) > _MAX_WARNINGS else similar(name, self._materials)
            self._warn(
                element,
                f"{where}: material {name!r} is not defined{hint}; the default colour is used",
            )
        return material

    def _defined(self, element: XmlElement, name: str) -> Material | None:
        """Return the material that an element defines; None if it only names one."""
        color, texture = _child(element, "color"), _child(element, "texture")
        if color is None and texture is None:
            return None
        material = Material(name)
        if color is not None:
            r, g, b, a = _numbers(color, "rgba", 4)
            if min(r, g, b, a) < 0 or max(r, g, b, a) > 1:
                self._warn(color, f"rgba is not from 0 to 1 and is cut off: {color.get('rgba')}")
                r, g, b, a = (min(max(value, 0.0), 1.0) for value in (r, g, b, a))
            material = replace(material, color=(r, g, b, a))
        if texture is not None:
            material = replace(material, texture=texture.get("filename", "").strip())
        return material

    # -- joints -----------------------------------------------------------------------------------

    def _joints(self, root: XmlElement, links: Mapping[str, Link]) -> dict[str, Joint]:
        for element in _children(root, "joint"):
            _register(element, self._joint_elements)
        elements = self._joint_elements.items()
        return {name: self._joint(element, name, links) for name, element in elements}

    def _joint(self, element: XmlElement, name: str, links: Mapping[str, Link]) -> Joint:
        where = f"joint {name!r}"
        joint_type = element.get("type", "")
        if joint_type not in _TYPES:
            raise _Broken(element, f"{where}: expected type {_listed(_TYPES)}, got {joint_type!r}")
        ends = {}
        for end in ("parent", "child"):
            found = _child(element, end)
            if found is None:
                raise _Broken(element, f"{where} has no <{end} link=...>")
            link = found.get("link", "")
            if link not in links:
                raise _Broken(
                    found, f"{where}: there is no {end} link {link!r}{similar(link, links)}"
                )
            ends[end] = link
        try:
            origin = _origin(element)
        except _Broken as broken:
            raise _Broken(element, f"{where}: {broken.reason}") from None
        return Joint(
            name,
            joint_type,
            ends["parent"],
            ends["child"],
            origin,
            axis=self._axis(element, joint_type, where),
            limits=self._limits(element, joint_type, where),
            mimic=self._mimic(element, where),
        )

    def _axis(self, joint: XmlElement, type: str, where: str) -> tuple[float, float, float]:
        element = _child(joint, "axis")
        if element is None or type in {"fixed", "floating"}:
            return (1.0, 0.0, 0.0)
        try:
            x, y, z = _numbers(element, "xyz", 3, (1.0, 0.0, 0.0))
        except _Broken as broken:
            raise _Broken(element, f"{where}: {broken.reason}") from None
        length = math.hypot(x, y, z)
        if not length:
            self._warn(element, f"{where}: <axis> is zero; the joint does not move")
            return (0.0, 0.0, 0.0)
        return (x / length, y / length, z / length)

    def _limits(self, joint: XmlElement, type: str, where: str) -> JointLimits | None:
        element = _child(joint, "limit")
        if element is None:
            if type in {"revolute", "prismatic"}:
                self._warn(joint, f"{where} is {type} and has no <limit>")
            return None
        try:
            return JointLimits(
                *(_number(element, key, 0.0) for key in ("lower", "upper", "effort", "velocity"))
            )
        except _Broken as broken:
            self._warn(element, f"{where}: {broken.reason}; its limits are ignored")
            return None

    def _mimic(self, joint: XmlElement, where: str) -> Mimic | None:
        element = _child(joint, "mimic")
        if element is None:
            return None
        try:
            return Mimic(
                element.get("joint", ""),
                _number(element, "multiplier", 1.0),
                _number(element, "offset", 0.0),
            )
        except _Broken as broken:
            self._warn(element, f"{where}: {broken.reason}; it mimics no joint")
            return None

    def _check_mimics(self, joints: dict[str, Joint]) -> None:
        """Remove mimics of unknown joints, and of the joint itself through others."""
        for joint in list(joints.values()):
            if joint.mimic is not None and joint.mimic.joint not in joints:
                unknown = joint.mimic.joint
                hint = "" if len(self._warnings) > _MAX_WARNINGS else similar(unknown, joints)
                joints[joint.name] = replace(joint, mimic=None)
                self._warnings.append(
                    f"{self._source}: joint {joint.name!r} mimics {unknown!r}, which does not "
                    f"exist{hint}; it is at 0"
                )
        ends: set[str] = set()
        for name in list(joints):
            chain: dict[str, None] = {}
            at = name
            while at not in ends and at not in chain:
                chain[at] = None
                mimic = joints[at].mimic
                if mimic is None:
                    break
                at = mimic.joint
            else:
                if at in chain:
                    joints[at] = replace(joints[at], mimic=None)
                    self._warnings.append(
                        f"{self._source}: joint {at!r} mimics itself, directly or over other "
                        "joints; it moves on its own"
                    )
            ends.update(chain)

    def _tree(
        self, links: Mapping[str, Link], joints: Mapping[str, Joint]
    ) -> tuple[str, tuple[Joint, ...]]:
        """Return the root link, and the joints in order from it."""
        parents: dict[str, Joint] = {}
        below: dict[str, list[Joint]] = {}
        for joint in joints.values():
            other = parents.setdefault(joint.child, joint)
            if other is not joint:
                raise _Broken(
                    self._joint_elements[joint.name],
                    f"link {joint.child!r} is the child of two joints, {other.name!r} and "
                    f"{joint.name!r}; a link has one parent",
                )
            below.setdefault(joint.parent, []).append(joint)
        roots = [name for name in links if name not in parents]
        if not roots:
            self._refuse_loop(parents, next(iter(links)))
        if len(roots) > 1:
            raise _Broken(
                self._link_elements[roots[1]],
                f"the robot has {len(roots)} root links: {_listed(roots)}; every link but one must "
                "be the child of a joint",
            )
        tree: list[Joint] = []
        pending = [roots[0]]
        while pending:
            joints_here = below.get(pending.pop(), ())
            tree.extend(joints_here)
            pending.extend(joint.child for joint in joints_here)
        if len(tree) < len(joints):
            reached = {joint.child for joint in tree}
            self._refuse_loop(parents, next(name for name in parents if name not in reached))
        return roots[0], tuple(tree)

    def _refuse_loop(self, parents: Mapping[str, Joint], link: str) -> NoReturn:
        """Raise for the loop that the joints above a link end in."""
        seen: dict[str, None] = {}
        while link not in seen:
            seen[link] = None
            link = parents[link].parent
        names = list(seen)
        loop = [*names[names.index(link) :], link]
        shown = loop if len(loop) <= 8 else [*loop[:4], "...", *loop[-3:]]
        raise _Broken(
            self._joint_elements[parents[link].name],
            f"the joints form a loop: {' <- '.join(shown)}; remove one of them",
        )

    def _warn(self, element: XmlElement, reason: str) -> None:
        self._warnings.append(f"{self._source}:{element.line}: {reason}")


# -- elements and attributes ------------------------------------------------------------------


def _children(element: XmlElement, tag: str) -> list[XmlElement]:
    return [child for child in element if child.tag == tag]  # type: ignore[misc]  # of read_xml()


def _child(element: XmlElement, tag: str) -> XmlElement | None:
    return next(iter(_children(element, tag)), None)


def _register(element: XmlElement, known: dict[str, XmlElement]) -> None:
    """Add an element by its name, which must be new."""
    name = _name(element)
    other = known.setdefault(name, element)
    if other is not element:
        raise _Broken(
            element,
            f"there are two {element.tag}s named {name!r}, the first in line {other.line}; rename "
            "or remove one",
        )


def _name(element: XmlElement) -> str:
    name = element.get("name", "")
    if not name:
        raise _Broken(element, f"a <{element.tag}> has no name; give it one: name=...")
    return name


def _numbers(
    element: XmlElement, key: str, count: int, default: tuple[float, ...] | None = None
) -> tuple[float, ...]:
    """Return an attribute of finite numbers, separated by spaces."""
    text = element.get(key)
    if text is None:
        if default is None:
            raise _Broken(element, f"<{element.tag}> has no {key}")
        return default
    wanted = f"{count} finite numbers" if count > 1 else "a finite number"
    words = text.split()
    try:
        found = tuple(map(float, words))
    except ValueError:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        hint = " (an expression of xacro: expand the file first)" if "${" in text else ""
        raise _Broken(
            element, f"{key} of <{element.tag}>: expected {wanted}, got {text[:80]!r}{hint}"
        )
    return found


def _number(element: XmlElement, key: str, default: float | None = None) -> float:
    return _numbers(element, key, 1, None if default is None else (default,))[0]


def _length(element: XmlElement, key: str) -> float:
    value = _number(element, key)
    if value < 0:
        raise _Broken(element, f"{key} of <{element.tag}> is negative: {value:g}")
    return value


def _geometry(element: XmlElement) -> Geometry:
    shapes = [child for child in element if isinstance(child, XmlElement)]
    if not shapes:
        raise _Broken(element, "<geometry> is empty; expected a <box>, <cylinder>, <mesh> ...")
    shape = shapes[0]
    if shape.tag == "box":
        x, y, z = _numbers(shape, "size", 3)
        if min(x, y, z) < 0:
            raise _Broken(shape, f"size of <box> is negative: {shape.get('size')}")
        return Box((x, y, z))
    if shape.tag == "cylinder":
        return Cylinder(_length(shape, "radius"), _length(shape, "length"))
    if shape.tag == "capsule":
        return Capsule(_length(shape, "radius"), _length(shape, "length"))
    if shape.tag == "sphere":
        return Sphere(_length(shape, "radius"))
    if shape.tag == "mesh":
        uri = shape.get("filename", "").strip()
        if not uri:
            raise _Broken(shape, "<mesh> has no filename")
        x, y, z = _numbers(shape, "scale", 3, (1.0, 1.0, 1.0))
        return MeshFile(uri, (x, y, z))
    raise _Broken(
        shape,
        f"unknown geometry <{shape.tag}>; expected <box>, <cylinder>, <sphere>, <capsule> or "
        "<mesh>",
    )


def _origin(element: XmlElement) -> Matrix:
    """Return the ``<origin>`` of an element as a matrix; the identity if it has none."""
    origin = _child(element, "origin")
    matrix = np.eye(4)
    if origin is None:
        return matrix
    matrix[:3, 3] = _numbers(origin, "xyz", 3, (0.0, 0.0, 0.0))
    if "quat_xyzw" in origin.keys():  # noqa: SIM118 - an Element is not a dict; URDF 1.2
        x, y, z, w = _numbers(origin, "quat_xyzw", 4)
        length = math.hypot(x, y, z, w)
        if not length:
            raise _Broken(origin, "quat_xyzw of <origin> is zero; expected a unit quaternion")
        sine = math.hypot(x, y, z) / length
        angle = 2 * math.atan2(sine, w / length)
        axis = (x, y, z) if sine else (1.0, 0.0, 0.0)
        scale = math.hypot(*axis)
        matrix[:3, :3] = _rotation((axis[0] / scale, axis[1] / scale, axis[2] / scale), angle)
        return matrix
    roll, pitch, yaw = _numbers(origin, "rpy", 3, (0.0, 0.0, 0.0))
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    matrix[:3, :3] = (  # about x by roll, then y by pitch, then z by yaw
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    return matrix


def _rotation(axis: tuple[float, float, float], angle: float) -> Matrix:
    """Return the rotation about a unit vector (or none, about zeros) by an angle in rad."""
    x, y, z = axis
    s, c = math.sin(angle), 1.0 - math.cos(angle)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Matrix = np.eye(3) + s * cross + c * (cross @ cross)
    return turned


def _finite(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise ArgumentError(name, value, "a finite number")
    return number


def _listed(names: Iterable[str]) -> str:
    names = list(names)
    more = f" and {len(names) - 10} more" if len(names) > 10 else ""
    return ", ".join(names[:10]) + more
