"""The mesh files of markers: read in the background, and kept for further markers."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from rosglass.errors import Error
from rosglass.scene.data.meshes import ending_of
from rosglass.scene.displays.marker_messages import MarkerRecord, scale_matrix
from rosglass.scene.displays.robot_model import STL_ENDINGS, MeshFiles, material_of
from rosglass.scene.render.drawing import OPAQUE, Mesh

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from rosglass.scene.data.resource_retriever import ResourceRetriever
    from rosglass.scene.render.mesh_shapes import Shape


__all__ = ["MarkerMeshes"]

#: Meshes that are kept for further markers, their bytes, and meshes that are being read.
_MAX_MESHES, _MAX_KEPT_BYTES, _MAX_READING = 200, 256 << 20, 1000
#: Bytes of the meshes and textures of all markers of a display.
_MAX_MESH_BYTES = 2 << 30


class _MeshFile(NamedTuple):
    """A mesh file that was read.

    Attributes:
        parts: For each part a drawable, with its texture, and the colour of its material; None in
            STL files, which have none.
        problem: Files that could not be read, in words; empty otherwise.
    """

    parts: list[tuple[Mesh, tuple[float, ...] | None]]
    problem: str

    @property
    def size(self) -> int:
        """Its size in bytes."""
        return sum(_size_of(mesh) for mesh, _ in self.parts)


def _size_of(mesh: Mesh) -> int:
    return mesh.shape.size + (0 if mesh.texture is None else mesh.texture.nbytes)


def _read_mesh(uri: str, resources: ResourceRetriever) -> _MeshFile:
    """Read a mesh and its textures; takes seconds for large ones."""
    made: list[tuple[Mesh, tuple[float, ...] | None]] = []
    problem = ""
    is_stl = ending_of(uri) in STL_ENDINGS
    files = MeshFiles(resources)
    for part, shape in files.mesh(uri):
        mesh = Mesh(shape)
        if part.texture is not None:
            try:
                files.paint(mesh, part.texture, uri)
            except (Error, OSError) as error:
                problem = str(error)
        made.append((mesh, None if is_stl else material_of(part)))
    return _MeshFile(made, problem)


def _embedded_looks(
    part: Mesh, own: tuple[float, ...] | None, color: tuple[float, ...]
) -> Iterable[tuple[Mesh, tuple[float, ...]]]:
    """Iterate over what is drawn of a part with the materials of its file, and its colours.

    As in RViz, a marker's colour is painted over them, half translucent, unless it is all zeros.
    """
    *rgb, alpha = color
    is_set, tint = any(color), (*rgb, min(alpha, 0.5))
    if own is None:
        plain = color if alpha >= OPAQUE else tint
        yield copy(part), plain if is_set else (1.0, 1.0, 1.0, 1.0)
        return
    yield copy(part), (*own[:3], alpha if is_set else 1.0)
    if is_set:
        yield Mesh(part.shape), tint


class MarkerMeshes:
    """Loads the meshes of markers in the scene's thread; until then they draw nothing.

    Args:
        background: Runs a function in another thread, with what finds files, and one with its
            result in the GUI thread.
        on_loaded: Called in the GUI thread with the URI, and with why it failed or "".
    """

    def __init__(
        self,
        background: Callable[[Callable[[ResourceRetriever], Any], Callable[[Any], None]], None],
        on_loaded: Callable[[str, str], None],
    ) -> None:
        self._background, self._on_loaded = background, on_loaded
        #: By URI, those used last at the end; None while it is being read.
        self._files: dict[str, _MeshFile | None] = {}
        self._reading = 0
        #: Bytes of each part that is kept or drawn.
        self._sizes: WeakKeyDictionary[Shape, int] = WeakKeyDictionary()

    def of(self, marker: MarkerRecord) -> Iterable[Mesh]:
        """Return the drawables of a mesh marker; begin to load it if need be.

        Raises:
            Error: Too many others are being loaded.
        """
        uri = marker.resource
        if uri not in self._files:
            if self._reading >= _MAX_READING:
                raise Error(f"more than {_MAX_READING} meshes are being read; send it again later")
            self._files[uri] = None
            self._reading += 1
            self._background(
                lambda resources: _read_mesh(uri, resources),
                lambda result: self._loaded(uri, result),
            )
        file = self._files[uri] = self._files.pop(uri)
        for part, own in file.parts if file is not None else ():
            looks: Iterable[tuple[Mesh, tuple[float, ...]]] = [(Mesh(part.shape), marker.color)]
            if marker.embedded:
                looks = _embedded_looks(part, own, marker.color)
            for mesh, color in looks:
                if np.prod(marker.scale) < 0:
                    mesh.shape = mesh.shape.mirrored()
                mesh.set_look(color=color)
                mesh.set_instances(scale_matrix(*marker.scale)[np.newaxis])
                yield mesh

    def problem_of(self, marker: MarkerRecord) -> str:
        """Return the problem with the file of a mesh marker, in words; empty without one."""
        file = self._files.get(marker.resource)
        return "" if file is None else file.problem

    def _loaded(self, uri: str, result: Any) -> None:
        self._reading -= 1
        file = result if isinstance(result, _MeshFile) else _MeshFile([], str(result))
        self._files.pop(uri, None)
        self._files[uri] = file
        self._drop_unused()
        if sum(self._sizes.values()) + file.size > _MAX_MESH_BYTES:
            text = f"with its {file.size} bytes, all meshes have more than {_MAX_MESH_BYTES}"
            file = self._files[uri] = _MeshFile([], f"{uri}: {text}; reduce them")
        self._sizes.update((mesh.shape, _size_of(mesh)) for mesh, _ in file.parts)
        self._on_loaded(uri, "" if file.parts else file.problem)

    def _drop_unused(self) -> None:
        """Forget the files that were used longest ago; markers that are shown keep theirs."""
        kept = {uri: file.size for uri, file in self._files.items() if file is not None}
        size = sum(kept.values())
        # Not the last one, which is asked for again as soon as it is there.
        for uri in list(kept)[:-1]:
            if len(kept) <= _MAX_MESHES and size <= _MAX_KEPT_BYTES:
                return
            size -= kept.pop(uri)
            del self._files[uri]

    def forget_failed(self, uris: Collection[str] | None = None) -> set[str]:
        """Forget files that could not be read, so that they are read again.

        Args:
            uris: The files, of meshes and of their textures, that may be there now; None for all.

        Returns:
            The URIs of the meshes.
        """
        failed = {uri: file.problem for uri, file in self._files.items() if file and file.problem}
        if uris is not None:
            failed = {k: text for k, text in failed.items() if any(one in text for one in uris)}
        for uri in failed:
            del self._files[uri]
        return set(failed)
