"""Meshes of robots and markers: STL, COLLADA and OBJ files, and through trimesh glTF, PLY and OFF.

Read as RViz does with assimp: in metres by COLLADA's ``<unit>``, with node transforms, without
turning by ``<up_axis>``; glTF, whose y axis points up, is turned to z. Colours of single vertices
are not read, as in RViz.

STL, COLLADA and OBJ have parsers here: trimesh needs pycollada and pillow for the latter two, and
loses what RViz shows (the paths of textures, flat faces where a file has no normals).
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import re
import stat
import struct
import threading
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias
from urllib.parse import unquote, urlsplit

import numpy as np

from rosglass.errors import ArgumentError, Error, UnsupportedError
from rosglass.extras import install_command
from rosglass.interfaces.type_descriptions import system_cache_folder
from rosglass.scene.data.collada import read_collada
from rosglass.scene.data.resources import check_texture, locate_resource, make_room
from rosglass.scene.data.triangles import (
    MAX_TRIANGLES,
    Color,
    MeshError,
    MeshPart,
    assemble,
    check_count,
    checked,
    face_normals,
    flat_part,
    from_top,
    merged,
    moved,
    relative,
    triangulate,
    unit_vectors,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float32]
    Integers: TypeAlias = NDArray[np.int64]

__all__ = [
    "MAX_TRIANGLES",
    "MeshError",
    "MeshPart",
    "ending_of",
    "load_mesh",
    "load_mesh_cached",
    "read_mesh_file",
    "read_resource",
]

#: Size of an STL file with the maximum number of triangles.
_MAX_FILE_BYTES = 512 << 20
#: Nodes of a glTF file.
_MAX_NODES = 100_000
_QUANTISED = "quantised glTF is not read; save it with floats (gltf-transform dequantize)"

_log = logging.getLogger("rosglass.scene")


def load_mesh(data: str | os.PathLike[str] | bytes, name: str = "") -> list[MeshPart]:
    """Read a mesh.

    Args:
        data: Path of the file, or its bytes.
        name: Name or URI of the file, for errors; needed for bytes, as its ending is that of the
            format, and textures are relative to it.

    Returns:
        Its triangles, one part for each colour and texture.

    Raises:
        MeshError: The file can't be read, is corrupt, has no triangles, or more than 10 million.
        UnsupportedError: The format is unknown, or needs trimesh (``rosglass[scene]``).
        ArgumentError: Bytes without a name.
    """
    return _parsed(*_content(data, name))


def read_resource(uri: str) -> bytes:
    """Return the bytes of a file on this machine that a robot, a marker or a mesh names.

    Raises:
        Error: There is no such file; it is too large, or can't be read.
    """
    path = os.fspath(locate_resource(uri))
    return read_mesh_file(path, path)


def load_mesh_cached(
    data: str | os.PathLike[str] | bytes,
    name: str = "",
    read: Callable[[str], bytes] = read_resource,
) -> list[MeshPart]:
    """Read a mesh, from the cache on disk if its content was read before.

    The cache is the folder ``rosglass/meshes`` in the system's cache folder (``XDG_CACHE_HOME``),
    of 512 MiB at most; without one that can be written, the mesh is parsed each time.

    Args:
        data: As for :func:`load_mesh`.
        name: As for :func:`load_mesh`.
        read: Returns the bytes of another file that the mesh names, by its URI or path.

    Raises:
        MeshError: As for :func:`load_mesh`.
        UnsupportedError: As for :func:`load_mesh`.
        ArgumentError: As for :func:`load_mesh`.
    """
    content, name, base = _content(data, name)
    if ending_of(base) == ".gltf":  # of several files
        return _parsed(content, name, base, read)
    cache = MeshCache(system_cache_folder("meshes"))
    key = _cache_key(content, name, base, read)
    parts = cache.get(key)
    if parts is None:
        parts = _parsed(content, name, base, read)
        cache.put(key, parts)
    return parts


def _content(data: str | os.PathLike[str] | bytes, name: str) -> tuple[bytes, str, str]:
    """Return the bytes of a mesh, its name for errors, and its path or URI."""
    if isinstance(data, (bytes, bytearray, memoryview)):
        if not name:
            raise ArgumentError("name", name, "name of the mesh file, such as arm.dae")
        if len(data) > _MAX_FILE_BYTES:
            raise MeshError(f"{name}: {len(data)} bytes; the limit is {_MAX_FILE_BYTES}")
        return bytes(data), name, name
    base = os.fspath(Path(data).absolute())
    name = name or base
    return read_mesh_file(base, name), name, base


def ending_of(uri: str) -> str:
    """Return the ending of a file's name in lower case, such as ``.stl``; a URL's has no query."""
    if uri.lower().startswith(("http:", "https:")):
        uri = urlsplit(uri).path
    return Path(uri).suffix.lower()


def _parsed(
    content: bytes, name: str, base: str, read: Callable[[str], bytes] = read_resource
) -> list[MeshPart]:
    reader = _reader(base, name, read)
    try:
        parts = [part for part in reader(content, name, base) if part.triangles]
        if not parts:
            raise MeshError(f"{name}: the file has no triangles")
        return [checked(part, name) for part in merged(parts)]
    except MemoryError:
        raise MeshError(f"{name}: there is not enough memory for it; reduce the mesh") from None


def read_mesh_file(path: str, name: str) -> bytes:
    """Return the bytes of a mesh file.

    Raises:
        MeshError: The path is not a file, the file is too large, or can't be read.
    """
    try:
        about = Path(path).stat()
        if not stat.S_ISREG(about.st_mode):
            raise MeshError(f"{name}: this is not a file")
        if about.st_size > _MAX_FILE_BYTES:
            raise MeshError(f"{name}: {about.st_size} bytes; the limit is {_MAX_FILE_BYTES}")
        with Path(path).open("rb") as file:
            return file.read(_MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise MeshError(f"{name}: the mesh can't be read: {error}") from None


def _reader(
    base: str, name: str, read: Callable[[str], bytes]
) -> Callable[[bytes, str, str], Sequence[MeshPart]]:
    ending = ending_of(base)
    with_trimesh = partial(_read_with_trimesh, read=read)
    readers: dict[str, Callable[[bytes, str, str], Sequence[MeshPart]]] = {
        ".stl": _read_stl,
        ".stlb": _read_stl,
        ".dae": read_collada,
        ".obj": partial(_read_obj, read=read),
        ".glb": with_trimesh,
        ".gltf": with_trimesh,
        ".ply": with_trimesh,
        ".off": with_trimesh,
    }
    if ending not in readers:
        raise UnsupportedError(
            f"{name}: {ending or 'a name without ending'} is not a supported format; convert "
            f"the mesh to one of {', '.join(readers)}"
        )
    return readers[ending]


def _file_beside(
    base: str, reference: str, name: str, read: Callable[[str], bytes]
) -> bytes | None:
    """Return the bytes of a file that a mesh file names; log and return None if there is none."""
    try:
        return read(relative(base, reference))
    except Error as error:
        _log.warning("%s: %s", name, error)
        return None


# -- the cache -----------------------------------------------------------------------------------

#: Version of the cached files, raised when the readers' results change.
_CACHE_VERSION = 2
_MAX_CACHE_BYTES = 512 << 20
#: Files of materials that an OBJ file can name.
_MAX_LIBRARIES = 16
_MTLLIB = re.compile(rb"^[ \t]*mtllib[ \t]+(.+?)\s*$", re.MULTILINE)


def _cache_key(content: bytes, name: str, base: str, read: Callable[[str], bytes]) -> str:
    """Return a hash of all that a mesh is made of, and of the folder of its textures."""
    folder = base.rpartition("/")[0]
    about = f"{_CACHE_VERSION} {ending_of(base)} {folder}"
    digest = hashlib.blake2b(about.encode("utf-8", "replace"), digest_size=20)
    digest.update(content)
    if ending_of(base) == ".obj":
        for library in list(dict.fromkeys(_MTLLIB.findall(content)))[:_MAX_LIBRARIES]:
            beside = _file_beside(base, library.decode("utf-8", "replace"), name, read)
            digest.update(b"-" if beside is None else beside)
    return digest.hexdigest()


class MeshCache:
    """Parsed meshes, a file for each; what fails only costs time."""

    def __init__(self, folder: str) -> None:
        self._folder = Path(folder)

    def get(self, key: str) -> list[MeshPart] | None:
        path = self._folder / f"{key}.npz"
        try:
            with np.load(path, allow_pickle=False) as file:
                stored = sum(info.file_size for info in file.zip.infolist())
                if stored > path.stat().st_size:
                    raise MeshError("the file is compressed")
                parts = [_part_of(file, about) for about in json.loads(file["about"].tobytes())]
            os.utime(path)  # the oldest files make room for new ones
        except FileNotFoundError:
            return None
        except Exception as error:  # of numpy and zipfile, for any content
            _log.warning("%s is not a cached mesh and is removed: %s", path, error)
            with suppress(OSError):
                path.unlink()
            return None
        return parts

    def put(self, key: str, parts: Sequence[MeshPart]) -> None:
        arrays: dict[str, NDArray[Any]] = {}
        about = []
        for number, part in enumerate(parts):
            for field in ("positions", "normals", "uv", "indices"):
                if getattr(part, field) is not None:
                    arrays[f"{field}{number}"] = getattr(part, field)
            if isinstance(part.texture, bytes):
                arrays[f"texture{number}"] = np.frombuffer(part.texture, np.uint8)
            path = part.texture if isinstance(part.texture, str) else None
            about.append({"number": number, "colour": part.color, "texture": path})
        arrays["about"] = np.frombuffer(json.dumps(about).encode(), np.uint8)
        size = sum(array.nbytes for array in arrays.values())
        if size > _MAX_CACHE_BYTES // 2:
            return
        part_file = self._folder / f"{key}.{os.getpid()}.{threading.get_ident()}"
        try:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            make_room(self._folder, size, _MAX_CACHE_BYTES)
            # Other processes see either the whole file or none.
            with part_file.open("wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type]
            part_file.replace(self._folder / f"{key}.npz")
        except (OSError, ValueError) as error:
            _log.info("meshes are not kept in %s: %s", self._folder, error)
            with suppress(OSError):
                part_file.unlink()


def _part_of(file: Any, about: dict[str, Any]) -> MeshPart:
    """Return a part of a cached file, checked as far as drawing needs it."""
    number, color = about["number"], about["colour"]

    def array(field: str, dtype: Any, *shape: int) -> Any:
        found = file[f"{field}{number}"]
        if found.dtype != dtype or found.shape[1:] != shape:
            raise MeshError(f"{field} is {found.dtype} of {found.shape}")
        return found

    names = file.files
    positions, normals = array("positions", np.float32, 3), array("normals", np.float32, 3)
    uv = array("uv", np.float32, 2) if f"uv{number}" in names else None
    indices = array("indices", np.uint32) if f"indices{number}" in names else None
    if len(normals) != len(positions) or (uv is not None and len(uv) != len(positions)):
        raise MeshError("the arrays have different lengths")
    if indices is not None and int(indices.max(initial=0)) >= len(positions):
        raise MeshError("an index is beyond the vertices")
    texture = about["texture"]
    if f"texture{number}" in names:
        texture = array("texture", np.uint8).tobytes()
    color = None if color is None else tuple(map(float, color))
    return MeshPart(positions, normals, uv, indices, color, texture)


# -- STL -----------------------------------------------------------------------------------------

_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
_NUMBERS = rb"\s+([^\s]+)\s+([^\s]+)\s+([^\s]+)"
_VERTEX = re.compile(rb"vertex" + _NUMBERS, re.IGNORECASE)


def _read_stl(data: bytes, name: str, _base: str) -> list[MeshPart]:
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    size = 84 + _STL.itemsize * count
    # Binary files that begin with "solid", as text files do, are common.
    start = data[:4096].lower()
    if len(data) != size and start.lstrip()[:5] == b"solid" and b"facet" in start:
        return [_read_text_stl(data, name)]
    if len(data) < 84 or len(data) < size:
        raise MeshError(
            f"{name}: the STL file has {len(data)} bytes, too few for {count} triangles; it is cut "
            "off or not an STL file"
        )
    check_count(name, count)
    table = np.frombuffer(data, _STL, count, 84)
    corners = np.ascontiguousarray(table["corners"])
    normals, bad = unit_vectors(table["normal"])
    if bad.any():
        normals = face_normals(corners)  # as RViz does where one is unusable
    return [MeshPart(corners.reshape(-1, 3), normals.repeat(3, axis=0))]


def _read_text_stl(data: bytes, name: str) -> MeshPart:
    words = _VERTEX.findall(data)
    if len(words) % 3 or len(words) < data.lower().count(b"vertex"):
        raise MeshError(f"{name}: the STL file is cut off: its triangles have too few vertices")
    check_count(name, len(words) // 3)
    try:
        positions = np.array(words).astype(np.float32).reshape(-1, 3)
    except ValueError as error:
        raise MeshError(f"{name}: a vertex of the STL file is not three numbers: {error}") from None
    return flat_part(positions)


# -- OBJ -----------------------------------------------------------------------------------------


def _read_obj(data: bytes, name: str, base: str, read: Callable[[str], bytes]) -> list[MeshPart]:
    return _Obj(name, base, read).parts(data.decode("utf-8", "replace"))


class _Obj:
    def __init__(self, name: str, base: str, read: Callable[[str], bytes]) -> None:
        self._name, self._base, self._read = name, base, read
        self._libraries: dict[str, None] = {}
        self._materials: dict[str | None, tuple[Color, str | None]] = {}
        #: The lines of vertices, texture coordinates and normals.
        self._rows: dict[str, list[str]] = {"v": [], "vt": [], "vn": []}
        #: Faces of the same material and layout, which numpy reads at once: the layout is the
        #: number of corners and of indices of a corner, and whether it has no texture coordinate.
        self._faces: dict[tuple[str | None, int, int, bool], list[str]] = {}

    def parts(self, text: str) -> list[MeshPart]:
        self._scan(text)
        for library in list(self._libraries)[:_MAX_LIBRARIES]:
            self._read_materials(library)
        positions = self._table("v", 3)
        uv = from_top(self._table("vt", 2))
        normals = self._table("vn", 3)
        parts = []
        triangles = 0
        for (material, count, width, has_gap), lines in self._faces.items():
            triangles += len(lines) * (count - 2)
            check_count(self._name, triangles)
            corners = self._corners(lines, count, width)
            for column, (array, kind) in enumerate(((positions, "v"), (uv, "vt"), (normals, "vn"))):
                used = column < width and not (column == 1 and has_gap)
                if used and not 0 <= corners[:, column].min() <= corners[:, column].max() < len(
                    array
                ):
                    raise MeshError(
                        f"{self._name}: a face has an index of {kind} that is not from 1 to "
                        f"{len(array)}"
                    )
            if count > 3:
                sizes = np.full(len(lines), count, np.int64)
                corners = corners[triangulate(sizes, positions[corners[:, 0]])]
            with_uv = width > 1 and not has_gap
            color, texture = self._materials.get(material, (None, None))
            part = assemble(
                positions,
                normals if width > 2 else None,
                uv if with_uv else None,
                (
                    corners[:, 0],
                    corners[:, 2] if width > 2 else None,
                    corners[:, 1] if with_uv else None,
                ),
            )
            parts.append(replace(part, color=color, texture=texture if with_uv else None))
        return parts

    def _scan(self, text: str) -> None:
        material: str | None = None
        for line in text.replace("\\\n", " ").replace("\\\r\n", " ").splitlines():
            key, rest = _split_key(line)
            if key in self._rows:
                self._rows[key].append(rest)
            elif key == "f":
                rest = rest.partition("#")[0].rstrip()
                if "/ " in rest or rest.endswith("/"):  # v/ or v/vt/ is v or v/vt
                    rest = re.sub(r"/+(?=\s|$)", "", rest)
                if "-" in rest:
                    rest = self._absolute(rest)
                count, slashes = len(rest.split()), rest.count("/")
                if count > 2:
                    layout = (material, count, 1 + slashes // count, "//" in rest)
                    self._faces.setdefault(layout, []).append(rest)
            elif key == "usemtl":
                material = rest.strip()
            elif key == "mtllib":
                self._libraries.setdefault(rest.strip())

    def _absolute(self, face: str) -> str:
        """Return a face with indices from the first vertex in place of ones from the last."""
        counts = [len(rows) for rows in self._rows.values()]
        corners = []
        for corner in face.split():
            indices = []
            for index, count in zip(corner.split("/"), counts, strict=False):
                is_relative = index.startswith("-") and index[1:].isdigit() and len(index) < 12
                indices.append(str(count + 1 + int(index)) if is_relative else index)
            corners.append("/".join(indices))
        return " ".join(corners)

    def _table(self, key: str, width: int) -> Floats:
        rows = self._rows[key]
        if not rows:
            return np.zeros((0, width), np.float32)
        try:
            values = np.fromstring(" ".join(rows), np.float32, sep=" ")
            if len(values) % len(rows) or len(values) < len(rows) * width:
                # Lines of different lengths; what is missing is 0.
                padded = [(row.split() + ["0"] * width)[:width] for row in rows]
                values = np.array(padded).astype(np.float32)
        except (ValueError, DeprecationWarning):
            raise MeshError(
                f"{self._name}: a line that begins with {key} contains something other than numbers"
            ) from None
        return np.ascontiguousarray(values.reshape(len(rows), -1)[:, :width])

    def _corners(self, lines: list[str], count: int, width: int) -> Integers:
        text = " ".join(lines).replace("//", "/1/").replace("/", " ")
        try:
            values = np.fromstring(text, np.int64, sep=" ")
            return values.reshape(len(lines) * count, width) - 1
        except (ValueError, DeprecationWarning):
            raise MeshError(
                f"{self._name}: a face is not of the form v, v/vt, v//vn or v/vt/vn: "
                f"{lines[0][:80]!r}"
            ) from None

    def _read_materials(self, file: str) -> None:
        data = _file_beside(self._base, file, self._name, self._read)
        if data is None:
            return
        material: str | None = None
        for line in data.decode("utf-8", "replace").splitlines():
            key, rest = _split_key(line)
            rest = rest.strip()
            if key == "newmtl":
                material = rest
                self._materials[material] = ((0.6, 0.6, 0.6, 1.0), None)  # assimp's default
            elif material is not None and key in {"Kd", "d", "Tr"}:
                (r, g, b, a), texture = self._materials[material]
                try:
                    values = [min(max(float(word), 0.0), 1.0) for word in rest.split()]
                    if key == "Kd":
                        r, g, b = values[:3]
                    else:
                        a = values[0] if key == "d" else 1.0 - values[0]
                except (ValueError, IndexError):
                    _log.warning("%s: %s of material %r is not a number", self._name, key, material)
                self._materials[material] = ((r, g, b, a), texture)
            elif material is not None and key == "map_Kd":
                color, _ = self._materials[material]
                # Options such as -s 1 1 1 stand before the name, which may have spaces.
                path = re.sub(r"^(?:-[a-z]+(?:\s+(?:on|off|[-+.\d]\S*))*\s+)*", "", rest)
                self._materials[material] = (color, relative(self._base, path))


def _split_key(line: str) -> tuple[str, str]:
    """Return the first word of a line, and the rest of it."""
    words = line.split(None, 1)
    return (words[0], words[1] if len(words) > 1 else "") if words else ("", "")


# -- glTF, PLY and OFF, through trimesh ----------------------------------------------------------


def _read_with_trimesh(
    data: bytes, name: str, base: str, read: Callable[[str], bytes]
) -> list[MeshPart]:
    ending = ending_of(base).removeprefix(".")
    try:
        trimesh: Any = import_module("trimesh")  # few need it, and it takes long
    except ImportError:
        raise UnsupportedError(
            f"{name}: {ending} files need trimesh: {install_command('scene')}; or convert the "
            "mesh to STL, DAE or OBJ"
        ) from None
    is_gltf = ending in {"glb", "gltf"}
    has_normals = _check_gltf(data, name) if is_gltf else _check_header(data, name)
    resolver = None
    if ending == "gltf":
        resolver = _Resolver(base, name, read)
    try:
        scene = trimesh.load(
            BytesIO(data), file_type=ending, resolver=resolver, force="scene", process=False
        )
        instances = [scene.graph[node] for node in scene.graph.nodes_geometry]
    except Error:
        raise
    except Exception as error:  # what trimesh raises for a corrupt file
        reason = str(error) or f"trimesh gives no reason ({type(error).__name__})"
        if b"KHR_mesh_quantization" in data:
            reason = f"{reason}; {_QUANTISED}"
        raise MeshError(f"{name}: the mesh can't be read: {reason}") from None
    # glTF's y axis points up, that of ROS to the side: x, y, z -> x, -z, y, as in RViz 2.
    up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], np.float64)
    parts: list[MeshPart] = []
    triangles = 0
    for matrix, key in instances:
        mesh = scene.geometry[key]
        if not isinstance(mesh, trimesh.Trimesh):
            continue  # points and lines
        triangles += len(mesh.faces)
        check_count(name, triangles)
        part = _from_trimesh(mesh, name, has_normals)
        parts.append(moved(part, up @ matrix if is_gltf else np.asarray(matrix, np.float64)))
    return parts


def _from_trimesh(mesh: Any, name: str, has_normals: bool) -> MeshPart:
    at = np.asarray(mesh.faces, np.int64).reshape(-1)
    positions = np.asarray(mesh.vertices, np.float32)
    if len(at) and not 0 <= at.min() <= at.max() < len(positions):
        raise MeshError(f"{name}: a face has an index beyond its {len(positions)} vertices")
    visual = mesh.visual
    uv = getattr(visual, "uv", None)
    if uv is not None and np.shape(uv) == (len(positions), 2):
        uv = from_top(np.asarray(uv, np.float32))
    else:
        uv = None
    color, texture = _trimesh_material(getattr(visual, "material", None), name)
    normals = np.asarray(mesh.vertex_normals, np.float32) if has_normals else None
    part = assemble(positions, normals, uv, (at, at, None if uv is None else at))
    return replace(part, color=color, texture=None if uv is None else texture)


def _trimesh_material(material: Any, name: str) -> tuple[Color | None, bytes | None]:
    if material is None:
        return None, None
    factor = getattr(material, "baseColorFactor", None)
    values = (255, 255, 255, 255) if factor is None else tuple(int(v) for v in factor)
    color = tuple(value / 255 for value in (*values, 255)[:4])
    image = getattr(material, "baseColorTexture", None)
    if image is None:
        return color, None  # type: ignore[return-value]
    file = BytesIO()
    try:
        width, height = image.size
        check_texture((width, height), name)
        image.save(file, "PNG", compress_level=1)
    except Error:
        raise
    except Exception as error:  # of pillow, for a corrupt image
        _log.warning("%s: a texture can't be read: %s", name, error)
        return color, None  # type: ignore[return-value]
    return color, file.getvalue()  # type: ignore[return-value]


class _Resolver:
    """Reads the files beside a .gltf file for trimesh."""

    def __init__(self, base: str, name: str, read: Callable[[str], bytes]) -> None:
        self._base, self._name, self._read = base, name, read

    def get(self, reference: str) -> bytes:
        return self[reference]

    def __getitem__(self, reference: str) -> bytes:
        data = _file_beside(self._base, unquote(reference), self._name, self._read)
        if data is None:
            raise MeshError(f"{self._name}: {reference} is missing")
        return data


def _check_gltf(data: bytes, name: str) -> bool:
    """Refuse data that trimesh does not limit; return whether all parts have normals."""
    text = data
    if data[:4] == b"glTF":
        length = int.from_bytes(data[12:16], "little")
        text = data[20 : 20 + length]
    try:
        about = json.loads(text)
        version = str(about["asset"].get("version", ""))
        if not version.startswith("2"):
            raise UnsupportedError(f"{name}: glTF {version} is not read; save it as glTF 2.0")
        required = set(about.get("extensionsRequired", ()))
        if required & {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}:
            raise UnsupportedError(f"{name}: compressed glTF is not read; save it uncompressed")
        nodes = about.get("nodes", [])
        children = [child for node in nodes for child in node.get("children", ())]
        roots = [root for scene in about.get("scenes", ()) for root in scene.get("nodes", ())]
        if len(nodes) > _MAX_NODES or len(set(children + roots)) < len(children) + len(roots):
            raise MeshError(f"{name}: the nodes do not form a tree, or are more than {_MAX_NODES}")
        views = about.get("bufferViews", [])
        for index, accessor in enumerate(about.get("accessors", ())):
            view = accessor.get("bufferView")
            size = 1 << 24 if view is None else views[view]["byteLength"]
            if not 0 <= accessor["count"] <= size:
                raise MeshError(
                    f"{name}: accessor {index} has {accessor['count']} elements in {size} bytes"
                )
        found = [p["attributes"] for mesh in about.get("meshes", ()) for p in mesh["primitives"]]
        accessors = about.get("accessors", ())
        positions = [attributes["POSITION"] for attributes in found if "POSITION" in attributes]
        if any(accessors[index].get("normalized") for index in positions):
            raise UnsupportedError(f"{name}: {_QUANTISED}")
        return all("NORMAL" in attributes for attributes in found)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        raise MeshError(
            f"{name}: the glTF file is corrupt: {type(error).__name__}: {error}"
        ) from None


def _check_header(data: bytes, name: str) -> bool:
    """Refuse a PLY or OFF file that declares more than it has; return whether it has normals."""
    header = data[: data.find(b"end_header") + 1] if data[:3] == b"ply" else data[:200]
    if data[:3] == b"ply":
        counts = re.findall(rb"element\s+\S+\s+(\d+)", header)
    else:
        counts = re.findall(rb"^\s*(?:C?OFF)?\s*(\d+)\s+(\d+)\s+\d+", header)
        counts = list(counts[0]) if counts else []
    if any(len(count) > 10 or int(count) > len(data) for count in counts):
        raise MeshError(f"{name}: {len(data)} bytes are too few for what its header declares")
    return b" nx" in header
