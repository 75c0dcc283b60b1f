"""COLLADA meshes (.dae), read as RViz does.

In metres by ``<unit>``, with the transforms of nodes, and not turned by ``<up_axis>``: RViz undoes
what assimp makes of it, and robots are modelled to fit. Skinned meshes are in their bind pose.
"""

from __future__ import annotations

import logging
import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias
from urllib.parse import unquote

import numpy as np

from rosglass.comm.xml_reader import XmlElement, XmlError, read_xml
from rosglass.scene.data.triangles import (
    Color,
    MeshError,
    MeshPart,
    assemble,
    check_count,
    from_top,
    moved,
    relative,
    triangulate,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from xml.etree.ElementTree import Element

    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float32]
    Integers: TypeAlias = NDArray[np.int64]
    Matrix: TypeAlias = NDArray[np.float64]

__all__ = ["read_collada"]

_MAX_FILE_BYTES = 256 << 20
#: Nodes can be used many times, and by themselves.
_MAX_NODES = 100_000
_MAX_NODE_DEPTH = 256

#: COLLADA's transforms, and how many numbers they have. lookat and skew are of cameras and art.
_TRANSFORMS = {"matrix": 16, "translate": 3, "rotate": 4, "scale": 3}
_ARRAYS = ("float_array", "int_array")
_PRIMITIVES = frozenset({"triangles", "polylist", "polygons", "tristrips", "trifans"})

_log = logging.getLogger("rosglass.scene")


def read_collada(data: bytes, name: str, base: str) -> list[MeshPart]:
    """Read a COLLADA file.

    Args:
        data: The file.
        name: Its name for errors.
        base: Its path or URI, which textures are relative to.

    Raises:
        MeshError: It is corrupt, or has more than 10 million triangles.
    """
    try:
        root = read_xml(data, name, _MAX_FILE_BYTES, _log.warning)
    except XmlError as error:
        raise MeshError(str(error)) from None
    if root.tag != "COLLADA":
        raise MeshError(f"{name}:{root.line}: expected <COLLADA>, got <{root.tag}>")
    return _Collada(root, name, base).parts()


class _Collada:
    def __init__(self, root: XmlElement, name: str, base: str) -> None:
        self._root, self._name, self._base = root, name, base
        #: Elements by tag and id: exporters use an id for a geometry and its node, too.
        self._ids = _by_id(root)
        #: The same of the geometry that is read: its sources may have the ids of another's.
        self._own_ids: dict[tuple[str, str], Element] = {}
        self._sources: dict[tuple[Element, int], Floats] = {}
        self._geometries: dict[Element, list[tuple[str, MeshPart]]] = {}
        self._materials: dict[str, tuple[Color | None, str | None]] = {}
        #: The material of parts whose own is not in the file: as in assimp, the first by its id.
        self._first_material = min(
            (
                key
                for (tag, key), found in self._ids.items()
                if tag == "material" and found.find("instance_effect") is not None
            ),
            default="",
        )
        self._triangles = 0

    def parts(self) -> list[MeshPart]:
        scale = np.diag((*(self._unit(),) * 3, 1.0))
        parts: list[MeshPart] = []
        pending = deque((node, scale, 0) for node in self._scene().findall("node"))
        visited = 0
        while pending:
            node, matrix, depth = pending.popleft()
            visited += 1
            if visited > _MAX_NODES or depth > _MAX_NODE_DEPTH:
                self._refuse(
                    node, f"more than {_MAX_NODES} nodes, or nodes that contain themselves"
                )
            for child in node:
                if child.tag in _TRANSFORMS:
                    matrix = matrix @ self._transform(child)
                elif child.tag in {"instance_geometry", "instance_controller"}:
                    parts.extend(moved(part, matrix) for part in self._instance(child))
            for child in node:
                if child.tag == "node":
                    pending.append((child, matrix, depth + 1))
                elif child.tag == "instance_node":
                    pending.append((self._target(child, "url", "node"), matrix, depth + 1))
        return parts

    def _unit(self) -> float:
        """Return the file's unit in metres."""
        element = self._root.find("asset/unit")
        text = "1" if element is None else element.get("meter", "1")
        try:
            unit = float(text.replace(",", "."))
        except ValueError:
            unit = math.nan
        if not 0 < unit < 1e9:
            _log.warning("%s: <unit meter=%r> is not a length; metres are used", self._name, text)
            return 1.0
        return unit

    def _scene(self) -> Element:
        instance = self._root.find("scene/instance_visual_scene")
        if instance is not None:
            return self._target(instance, "url", "visual_scene")
        scene = self._root.find("library_visual_scenes/visual_scene")
        if scene is None:
            self._refuse(self._root, "the file has no <visual_scene>, so nothing to show")
        return scene

    def _transform(self, element: Element) -> Matrix:
        kind = element.tag
        values = self._array(element, np.float64)
        if len(values) != _TRANSFORMS[kind] or not np.isfinite(values).all():
            self._refuse(element, f"expected {_TRANSFORMS[kind]} finite numbers")
        matrix = np.eye(4)
        if kind == "matrix":
            return values.reshape(4, 4)
        if kind == "translate":
            matrix[:3, 3] = values
        elif kind == "scale":
            matrix[(0, 1, 2), (0, 1, 2)] = values
        elif kind == "rotate" and values[:3].any():
            x, y, z = values[:3] / np.linalg.norm(values[:3])
            s, c = math.sin(math.radians(values[3])), math.cos(math.radians(values[3]))
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            matrix[:3, :3] += s * cross + (1.0 - c) * (cross @ cross)
        return matrix

    # -- geometry ------------------------------------------------------------------------------

    def _instance(self, instance: Element) -> Iterator[MeshPart]:
        """Yield the parts of a geometry, with the materials that a node binds to it."""
        target = self._target(instance, "url", "geometry", "controller")
        for _ in range(3):  # a controller's skin or morph, and what that deforms
            deformer = target.find("skin") if target.tag == "controller" else None
            deformer = target.find("morph") if deformer is None else deformer
            if deformer is None:
                break
            target = self._target(deformer, "source", "geometry", "controller")
        bindings = {
            bound.get("symbol", ""): bound.get("target", "").removeprefix("#")
            for bound in instance.iterfind("bind_material/technique_common/instance_material")
        }
        for symbol, part in self._geometry(target):
            self._triangles += part.triangles
            check_count(self._name, self._triangles)
            # As in assimp, what is not bound has the first material that is, or that of its name.
            first = bindings[min(bindings)] if bindings else symbol
            color, texture = self._material(bindings.get(symbol, first))
            yield replace(part, color=color, texture=None if part.uv is None else texture)

    def _geometry(self, geometry: Element) -> list[tuple[str, MeshPart]]:
        if geometry not in self._geometries:
            mesh = geometry.find("mesh")
            found = [] if mesh is None else [p for p in mesh if p.tag in _PRIMITIVES]
            self._own_ids = _by_id(geometry)
            read = ((p.get("material", ""), self._primitive(p)) for p in found)
            self._geometries[geometry] = [(name, part) for name, part in read if part is not None]
        return self._geometries[geometry]

    def _primitive(self, element: Element) -> MeshPart | None:
        inputs, width = self._inputs(element)
        polygons = self._polygons(element, width)
        if polygons is None:
            return None
        corners, counts = polygons
        if "POSITION" not in inputs:
            self._refuse(element, f"<{element.tag}> has no POSITION")
        arrays: dict[str, tuple[Floats, Integers]] = {}
        for semantic, (source, offset) in inputs.items():
            array = self._source(source, 2 if semantic == "TEXCOORD" else 3)
            index = corners[:, offset]
            if len(index) and not 0 <= index.min() <= index.max() < len(array):
                wrong = int(index.max() if index.min() >= 0 else index.min())
                self._refuse(
                    element, f"index {wrong} of {semantic}, of which there are {len(array)}"
                )
            arrays[semantic] = (array, index)
        positions, at = arrays["POSITION"]
        order = slice(None)
        if counts is not None:
            check_count(self._name, int(np.maximum(counts - 2, 0).sum()))
            order = triangulate(counts, positions[at])  # type: ignore[assignment]
        check_count(self._name, len(at) // 3)
        shared = {offset: corners[:, offset][order] for _, offset in inputs.values()}
        normals, uv = arrays.get("NORMAL"), arrays.get("TEXCOORD")
        return assemble(
            positions,
            None if normals is None else normals[0],
            None if uv is None else from_top(uv[0]),
            (
                shared[inputs["POSITION"][1]],
                None if normals is None else shared[inputs["NORMAL"][1]],
                None if uv is None else shared[inputs["TEXCOORD"][1]],
            ),
        )

    def _inputs(self, element: Element) -> tuple[dict[str, tuple[Element, int]], int]:
        """Return source and offset by semantic, and the number of indices of a corner."""
        inputs: dict[str, tuple[Element, int]] = {}
        sets: dict[str, int] = {}
        width = 1
        for found in element.iterfind("input"):
            try:
                offset, number = int(found.get("offset", "0")), int(found.get("set", "0"))
            except ValueError:
                offset = number = -1
            if not 0 <= offset < 64:
                self._refuse(found, "expected an offset from 0 to 63 and a whole number as set")
            width = max(width, offset + 1)
            semantic, source = (
                found.get("semantic", ""),
                self._target(found, "source", "source", "vertices"),
            )
            own = source.iterfind("input") if semantic == "VERTEX" else (found,)
            for entry in own:
                meaning = entry.get("semantic", "")
                # Of several, the first set of texture coordinates is used, as in RViz.
                if number < sets.get(meaning, 1 << 31):
                    sets[meaning] = number
                    target = source if entry is found else self._target(entry, "source", "source")
                    if meaning in {"POSITION", "NORMAL", "TEXCOORD"}:
                        inputs[meaning] = (target, offset)
        return inputs, width

    def _polygons(self, element: Element, width: int) -> tuple[Integers, Integers | None] | None:
        """Return the corners, and the number of corners of each polygon; None for triangles."""
        lists = element.findall("p") + [p for ph in element.iterfind("ph") for p in ph.findall("p")]
        found = [self._array(p, np.int32).astype(np.int64) for p in lists]
        for p, array in zip(lists, found, strict=True):
            if len(array) % width:
                self._refuse(p, f"{len(array)} indices; expected a multiple of {width}")
        lengths = np.array([len(array) // width for array in found], np.int64)
        corners = np.concatenate(found).reshape(-1, width) if found else np.zeros((0, width), int)
        if not len(corners):
            return None
        counts: Integers | None = None
        if element.tag == "triangles":
            if len(corners) % 3:
                self._refuse(
                    element, f"{len(corners)} corners of triangles; expected a multiple of 3"
                )
        elif element.tag == "polygons":
            counts = lengths
        elif element.tag == "polylist":
            listed = element.find("vcount")
            if listed is None:
                self._refuse(element, "<polylist> has no <vcount>")
            counts = self._array(listed, np.int32).astype(np.int64)
            if counts.min(initial=0) < 0 or counts.sum() != len(corners):
                self._refuse(listed, f"it does not count the {len(corners)} corners of <p>")
        else:  # strips and fans
            corners = corners[_strips(lengths, element.tag == "tristrips")]
        return (corners, counts) if len(corners) else None

    def _source(self, source: Element, width: int) -> Floats:
        """Return the rows of a ``<source>``."""
        key = (source, width)
        if key in self._sources:
            return self._sources[key]
        accessor = source.find("technique_common/accessor")
        if accessor is None:
            self._refuse(source, "<source> has no <accessor>")
        values = self._array(self._target(accessor, "source", *_ARRAYS), np.float32)
        try:
            count, stride, offset = (
                int(accessor.get(name, default))
                for name, default in (("count", "0"), ("stride", "1"), ("offset", "0"))
            )
        except ValueError:
            count = stride = offset = -1
        if min(count, offset) < 0 or stride < width or offset + count * stride > len(values):
            self._refuse(
                accessor,
                f"it declares more than the {len(values)} numbers there are, or fewer than {width} "
                "for each vertex",
            )
        rows = values[offset : offset + count * stride].reshape(-1, stride)[:, :width]
        self._sources[key] = np.ascontiguousarray(rows)
        return self._sources[key]

    def _array(self, element: Element, dtype: Any) -> NDArray[Any]:
        text = (element.text or "").strip().replace(",", ".")  # of exporters with a locale
        if not text:  # numpy reads a number from spaces
            return np.zeros(0, dtype)
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            self._refuse(element, f"<{element.tag}> contains something other than numbers")

    # -- materials -----------------------------------------------------------------------------

    def _material(self, key: str) -> tuple[Color | None, str | None]:
        """Return the colour and texture of a material by its id, or of the file's first one."""
        if key not in self._materials:
            material = self._ids.get(("material", key))
            instance = None if material is None else material.find("instance_effect")
            found: tuple[Color | None, str | None] = (None, None)
            if instance is not None:
                found = self._effect(self._target(instance, "url", "effect"))
            elif key != self._first_material:
                found = self._material(self._first_material)
            self._materials[key] = found
        return self._materials[key]

    def _effect(self, effect: Element) -> tuple[Color | None, str | None]:
        shading = next(
            (
                found
                for model in ("phong", "lambert", "blinn", "constant")
                for found in effect.iterfind(f"profile_COMMON/technique/{model}")
            ),
            None,
        )
        if shading is None:
            return None, None
        alpha = self._opacity(shading)
        for channel in ("diffuse", "emission"):
            sampler = shading.find(f"{channel}/texture")
            if sampler is not None:
                texture = self._image_path(effect, sampler.get("texture", ""))
                if texture is not None:
                    return (1.0, 1.0, 1.0, alpha), texture
            color = shading.find(f"{channel}/color")
            if color is not None:
                r, g, b, _ = self._color(color)
                return (r, g, b, alpha), None
        return (0.6, 0.6, 0.6, alpha), None  # assimp's default

    def _color(self, element: Element) -> Color:
        values = self._array(element, np.float64)
        if len(values) not in {3, 4} or not np.isfinite(values).all():
            self._refuse(element, "expected a colour of 3 or 4 finite numbers")
        r, g, b, *alpha = (min(max(float(value), 0.0), 1.0) for value in values)
        return (r, g, b, alpha[0] if alpha else 1.0)

    def _opacity(self, shading: Element) -> float:
        """Return the opacity by the rules of COLLADA 1.5."""
        transparent = shading.find("transparent")
        mode = "A_ONE" if transparent is None else transparent.get("opaque", "A_ONE")
        color = None if transparent is None else transparent.find("color")
        r, g, b, a = (0.0, 0.0, 0.0, 1.0) if color is None else self._color(color)
        factor = 1.0
        number = shading.find("transparency/float")
        if number is not None:
            found = self._array(number, np.float64)
            factor = float(found[0]) if len(found) == 1 and 0 <= found[0] <= 1 else 1.0
        if mode.startswith("RGB"):
            a = 0.212671 * r + 0.715160 * g + 0.072169 * b
        return 1.0 - a * factor if mode.endswith("ZERO") and color is not None else a * factor

    def _image_path(self, effect: Element, sampler: str) -> str | None:
        """Return the path of a sampler's image file, or of an image by its id."""
        parameters = {found.get("sid"): found for found in effect.iter("newparam")}
        key = sampler
        for _ in range(3):  # sampler, surface, image
            parameter = parameters.get(key)
            if parameter is None:
                break
            for path in ("sampler2D/source", "surface/init_from", "sampler2D/instance_image"):
                found = parameter.find(path)
                if found is not None:
                    key = (found.text or found.get("url") or "").strip().removeprefix("#")
        image = self._ids.get(("image", key))
        source = None if image is None else image.find("init_from/ref")  # of COLLADA 1.5
        if source is None and image is not None:
            source = image.find("init_from")
        text = "" if source is None else source.text or ""
        if not text.strip():
            _log.warning("%s: texture %r has no image", self._name, sampler)
            return None
        return relative(self._base, unquote(text))

    # ------------------------------------------------------------------------------------------

    def _target(self, element: Element, attribute: str, *tags: str) -> Element:
        """Return the element with one of these tags that another one refers to."""
        url = element.get(attribute, "")
        places = [(ids, (tag, url[1:])) for ids in (self._own_ids, self._ids) for tag in tags]
        for ids, key in places if url.startswith("#") else ():
            if key in ids:
                return ids[key]
        return self._refuse(
            element, f"{attribute} of <{element.tag}>: there is no {url!r} in the file"
        )

    def _refuse(self, element: Element, reason: str) -> NoReturn:
        raise MeshError(f"{self._name}:{getattr(element, 'line', 0)}: {reason}")


def _by_id(root: Element) -> dict[tuple[str, str], Element]:
    """Return the elements with an id by tag and id, the first of each."""
    found: dict[tuple[str, str], Element] = {}
    for element in root.iter():
        if "id" in element.keys():  # noqa: SIM118 - an Element is not a dict
            found.setdefault((element.tag, element.get("id", "")), element)
    return found


def _strips(lengths: Integers, is_strip: bool) -> Integers:
    """Return the corners of the triangles of strips or fans."""
    counts = np.maximum(lengths - 2, 0)
    start = (np.cumsum(lengths) - lengths).repeat(counts)
    step = np.arange(len(start)) - (np.cumsum(counts) - counts).repeat(counts)
    if not is_strip:
        return np.stack((start, start + step + 1, start + step + 2), axis=1).reshape(-1)
    odd = step % 2  # every other triangle of a strip is turned
    at = start + step
    return np.stack((at, at + 1 + odd, at + 2 - odd), axis=1).reshape(-1)
