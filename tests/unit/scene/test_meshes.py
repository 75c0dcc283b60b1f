"""Mesh files: what RViz shows of them, and what hostile ones get."""

from __future__ import annotations

import json
import os
import re
import struct
import threading
import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rosglass.errors import ArgumentError, Error, UnsupportedError
from rosglass.scene.data import meshes, triangles
from rosglass.scene.data.meshes import MeshError, MeshPart, load_mesh, load_mesh_cached

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

SQUARE = "0 0 0 100 0 0 100 100 0 0 100 0"
SQUARE_UV = "0 0 1 0 1 1 0 1"


def source(key: str, numbers: str, width: int) -> str:
    count = len(numbers.split())
    return (
        f'<source id="{key}"><float_array id="{key}-array" count="{count}">{numbers}'
        f'</float_array><technique_common><accessor source="#{key}-array" '
        f'count="{count // width}" stride="{width}"/></technique_common></source>'
    )


def element(
    tag: str = "polylist",
    body: str = "<vcount>4</vcount><p>0 0 0 1 0 1 2 0 2 3 0 3</p>",
    semantics: Sequence[str] = ("VERTEX", "NORMAL", "TEXCOORD"),
    material: str = "symbol",
) -> str:
    inputs = "".join(
        f'<input semantic="{semantic}" source="#{semantic.lower()}" offset="{offset}"/>'
        for offset, semantic in enumerate(semantics)
    )
    return f'<{tag} material="{material}" count="1">{inputs}{body}</{tag}>'


def geometry(primitives: str = "", positions: str = SQUARE, key: str = "square") -> str:
    return (
        f'<geometry id="{key}"><mesh>{source("positions", positions, 3)}'
        f"{source('normal', '0 0 1', 3)}{source('texcoord', SQUARE_UV, 2)}"
        '<vertices id="vertex"><input semantic="POSITION" source="#positions"/></vertices>'
        f"{primitives or element()}</mesh></geometry>"
    )


def node(transforms: str = "", target: str = "square", material: str = "", key: str = "") -> str:
    binding = (
        '<bind_material><technique_common><instance_material symbol="symbol" '
        f'target="#{material}"/></technique_common></bind_material>'
        if material
        else ""
    )
    instance = f'<instance_geometry url="#{target}">{binding}</instance_geometry>'
    return f'<node id="{key}">{transforms}{instance if target else ""}</node>'


def effect(channels: str, parameters: str = "", key: str = "effect") -> str:
    return (
        f'<effect id="{key}"><profile_COMMON>{parameters}<technique><phong>{channels}</phong>'
        f'</technique></profile_COMMON></effect><material id="{key}-m">'
        f'<instance_effect url="#{key}"/></material>'
    )


def collada(
    nodes: str = "", geometries: str = "", materials: str = "", unit: str = "", asset: str = ""
) -> bytes:
    unit = f'<unit name="u" meter="{unit}"/>' if unit else ""
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">\n'
        f"<asset>{unit}{asset}</asset><library>{materials}</library>\n"
        f"<library_geometries>{geometries or geometry()}</library_geometries>\n"
        f'<library_visual_scenes><visual_scene id="scene">{nodes or node()}</visual_scene>'
        '</library_visual_scenes>\n<scene><instance_visual_scene url="#scene"/></scene></COLLADA>'
    ).encode()


def stl(corners: Any, normals: Any = 0.0, header: bytes = b"") -> bytes:
    corners = np.asarray(corners, np.float32).reshape(-1, 3, 3)
    table = np.zeros(
        len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")]
    )
    table["corners"], table["normal"] = corners, normals
    return header.ljust(80) + struct.pack("<I", len(corners)) + table.tobytes()


def one(data: bytes, name: str) -> MeshPart:
    (part,) = load_mesh(data, name)
    return part


def corners(part: MeshPart, array: str = "positions") -> list[list[float]]:
    """Return the corners of a part's triangles, one after the other."""
    values = getattr(part, array)
    found = values if part.indices is None else values[part.indices]
    return np.round(found, 5).tolist()


TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 2, 0]]


# -- STL -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("header", [b"", b"solid made by a CAD program"])
def test_binary_stl(header: bytes) -> None:
    part = one(stl(TRIANGLE, header=header), "a.stl")
    assert corners(part) == TRIANGLE
    assert part.normals.tolist() == [[0, 0, 1]] * 3  # of the triangle: the file has none
    assert (part.indices, part.uv, part.color, part.texture) == (None, None, None, None)
    assert (part.positions.dtype, part.normals.dtype) == (np.float32, np.float32)
    assert part.positions.flags.c_contiguous
    assert part.triangles == 1


def test_normals_of_stl_files_are_kept_if_all_are_usable() -> None:
    kept = one(stl([TRIANGLE, TRIANGLE], [[0, 3, 0], [1, 0, 0]]), "a.STL")
    assert kept.normals[[0, 3]].tolist() == [[0, 1, 0], [1, 0, 0]]
    made = one(stl([TRIANGLE, TRIANGLE], [[0, 3, 0], [np.nan, 0, 0]]), "a.STL")
    assert made.normals[[0, 3]].tolist() == [[0, 0, 1], [0, 0, 1]]


def test_text_stl() -> None:
    text = (
        "solid two words\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n"
        "   vertex 0 2.0 0\n  endloop\n endfacet\nendsolid two words\n"
    )
    assert corners(one(text.encode(), "a.stl")) == TRIANGLE
    assert corners(one(text.upper().encode(), "a.stl")) == TRIANGLE
    for broken, message in (
        (text.replace("   vertex 0 0 0\n", ""), "too few vertices"),
        (text.replace("2.0 0", "two 0"), "not three numbers"),
        (text.replace("   vertex 0 0 0", "vertex 0"), "too few vertices|not three numbers"),
        ("solid empty\nfacet\nendsolid\n", "no triangles"),
    ):
        with pytest.raises(MeshError, match=rf"a\.stl: .*({message})"):
            load_mesh(broken.encode(), "a.stl")


# -- COLLADA ---------------------------------------------------------------------------------------


def test_collada_in_metres_and_not_turned_by_its_up_axis() -> None:
    for axis in ("X_UP", "Y_UP", "Z_UP"):
        part = one(collada(unit="0.01", asset=f"<up_axis>{axis}</up_axis>"), "a.dae")
        assert part.positions.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
        assert part.indices is not None
        assert part.indices.tolist() == [0, 1, 2, 0, 2, 3]
        assert part.indices.dtype == np.uint32
    assert part.uv is not None
    assert part.uv.tolist() == [[0, 1], [1, 1], [1, 0], [0, 0]]  # from the top left


def test_transforms_of_nodes() -> None:
    turn = "<translate>0 0 1</translate><rotate>0 0 2 90</rotate><scale>1 2 1</scale>"
    inner = "<matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"
    nodes = node(turn, target="").replace("</node>", node(inner) + "</node>")
    part = one(collada(nodes), "a.dae")
    assert corners(part)[:3] == [[0, 5, 1], [0, 105, 1], [-200, 105, 1]]
    assert part.normals[0].tolist() == [0, 0, 1]


def test_normals_under_uneven_scale_and_mirrors() -> None:
    slope = geometry(positions="0 0 0 1 0 1 1 1 1 0 1 0").replace("0 0 1<", "-1 0 1<", 1)
    part = one(collada(node("<scale>2 1 1</scale>"), slope), "a.dae")
    assert np.allclose(part.normals[0], np.array([-1, 0, 2]) / 5**0.5)
    mirrored = one(collada(node("<scale>1 1 -1</scale>")), "a.dae")
    assert mirrored.normals[0].tolist() == [0, 0, -1]
    assert mirrored.indices is not None
    assert mirrored.indices.tolist() == [2, 1, 0, 3, 2, 0]  # still seen from outside
    flat = one(collada(node("<scale>1 1 0</scale>")), "a.dae")
    assert np.isfinite(flat.normals).all()


def test_nodes_are_used_again() -> None:
    library = f"<library_nodes>{node(key='shared')}</library_nodes>"
    nodes = "".join(
        f'<node><translate>{x} 0 0</translate><instance_node url="#shared"/></node>' for x in (0, 7)
    )
    part = one(collada(nodes, materials=library), "a.dae")
    assert part.triangles == 4  # one part, as both are drawn alike
    assert corners(part)[6] == [7, 0, 0]


def test_skins_and_morphs_are_in_their_bind_pose() -> None:
    controllers = '<controller id="c"><skin source="#m"/></controller>'
    controllers += '<controller id="m"><morph source="#square"/></controller>'
    nodes = '<node><instance_controller url="#c"/></node>'
    assert one(collada(nodes, materials=controllers), "a.dae").triangles == 2


POSITIONS_ONLY = ("VERTEX",)


@pytest.mark.parametrize(
    ("primitive", "expected"),
    [
        (element("triangles", "<p>0 1 2 0 2 3</p>", POSITIONS_ONLY), [0, 1, 2, 0, 2, 3]),
        (
            element("polygons", "<p>0 1 2 3</p><p>3 2 1</p>", POSITIONS_ONLY),
            [0, 1, 2, 0, 2, 3, 3, 2, 1],
        ),
        (element("polylist", "<vcount>2 3</vcount><p>0 1 1 2 3</p>", POSITIONS_ONLY), [1, 2, 3]),
        (
            element("tristrips", "<p>0 1 3 2</p><p>0 1 2</p>", POSITIONS_ONLY),
            [0, 1, 3, 1, 2, 3, 0, 1, 2],
        ),
        (element("trifans", "<p>0 1 2 3</p>", POSITIONS_ONLY), [0, 1, 2, 0, 2, 3]),
        (
            element("triangles", "<p>0 1 2</p>", POSITIONS_ONLY) + element("lines", "<p>0 1</p>"),
            [0, 1, 2],
        ),
    ],
)
def test_primitives(primitive: str, expected: list[int]) -> None:
    part = one(collada(geometries=geometry(primitive)), "a.dae")
    points = np.array(SQUARE.split(), float).reshape(-1, 3)
    assert corners(part) == points[expected].tolist()
    # Without normals, every triangle is flat, as in RViz.
    assert part.indices is None
    assert np.abs(part.normals[:, 2]).tolist() == [1] * len(expected)


@pytest.mark.parametrize(
    ("outline", "area"),
    [
        ("1 1 0 0 4 0 0 0 0 4 0 0", 4),  # a dart
        ("0 0 0 3 0 0 3 3 0 2 3 0 2 1 0 1 1 0 1 3 0 0 3 0", 7),  # a U
        # A square with a square hole, as exporters write it: with a bridge of no width.
        ("0 0 0 3 0 0 3 3 0 0 3 0 0 0 0 1 1 0 1 2 0 2 2 0 2 1 0 1 1 0", 8),
        ("0 0 0 1 1 0 2 0 0 2 2 0 0 2 0", 3),
    ],
)
@pytest.mark.parametrize("turns", range(4))
def test_polygons_that_are_not_convex(outline: str, area: float, turns: int) -> None:
    points = np.roll(np.array(outline.split(), float).reshape(-1, 3), turns, axis=0)
    turned = points[:, np.roll((0, 1, 2), turns)]
    count = len(points)
    body = f"<vcount>{count}</vcount><p>{' '.join(map(str, range(count)))}</p>"
    positions = " ".join(map(str, turned.reshape(-1)))
    shape = geometry(element(body=body, semantics=POSITIONS_ONLY), positions)
    part = one(collada(geometries=shape), "a.dae")
    a, b, c = part.positions.reshape(-1, 3, 3).transpose(1, 0, 2)
    areas = np.cross(b - a, c - a) / 2
    # All face the same way, and cover the polygon once.
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(area)
    assert np.linalg.norm(areas.sum(axis=0)) == pytest.approx(area)


def test_many_polygons_that_are_not_convex_take_no_time() -> None:
    comb = "".join(f"v {i} {5 * (i % 2)} 0\n" for i in range(5000)) + "v 5000 -9 0\nv -1 -9 0\n"
    text = comb + ("f " + " ".join(map(str, range(1, 5003))) + "\n") * 50
    assert one(text.encode(), "a.obj").triangles == 5000 * 50


def channel(name: str, color: str, opaque: str = "") -> str:
    opaque = f' opaque="{opaque}"' if opaque else ""
    return f"<{name}{opaque}><color>{color}</color></{name}>"


WHITE = channel("diffuse", "1 1 1 1")


@pytest.mark.parametrize(
    ("channels", "color"),
    [
        (channel("diffuse", "1 0.5 0 1"), (1, 0.5, 0, 1)),
        (channel("diffuse", "1 0.5 0"), (1, 0.5, 0, 1)),
        (channel("diffuse", "2 -1 0 1"), (1, 0, 0, 1)),
        (channel("emission", "0 1 0 1"), (0, 1, 0, 1)),
        ("", (0.6, 0.6, 0.6, 1)),
        (f"{WHITE}<transparency><float>0.25</float></transparency>", (1, 1, 1, 0.25)),
        (WHITE + channel("transparent", "0.5 0.5 0.5 1", "RGB_ZERO"), (1, 1, 1, 0.5)),
        (WHITE + channel("transparent", "0 0 0 0.25", "A_ZERO"), (1, 1, 1, 0.75)),
        (WHITE + channel("transparent", "0 0 0 0.25"), (1, 1, 1, 0.25)),
    ],
)
def test_materials(channels: str, color: tuple[float, ...]) -> None:
    part = one(collada(node(material="effect-m"), materials=effect(channels)), "a.dae")
    assert part.color == pytest.approx(color)


def test_parts_have_the_materials_that_the_node_binds() -> None:
    materials = "".join(
        effect(f"<diffuse><color>{color} 1</color></diffuse>", key=key)
        for key, color in (("red", "1 0 0"), ("green", "0 1 0"))
    )
    nodes = node(material="red-m") + node() + node("<translate>9 9 9</translate>", material="red-m")
    red, unbound = load_mesh(collada(nodes, materials=materials), "a.dae")
    assert (red.color, red.triangles) == ((1, 0, 0, 1), 4)
    assert (unbound.color, unbound.triangles) == ((0, 1, 0, 1), 2)
    assert one(collada(), "a.dae").color is None


@pytest.mark.parametrize("is_direct", [False, True])
def test_textures(is_direct: bool, tmp_path: Path) -> None:
    parameters = (
        '<newparam sid="surface"><surface><init_from>image</init_from></surface></newparam>'
        '<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>'
    )
    channel = f'<diffuse><texture texture="{"image" if is_direct else "sampler"}"/></diffuse>'
    materials = effect(channel, "" if is_direct else parameters)
    materials += '<image id="image"><init_from>../my%20wood.png</init_from></image>'
    data = collada(node(material="effect-m"), materials=materials)
    assert one(data, "package://arm/meshes/a.dae").texture == "package://arm/meshes/../my wood.png"
    file = tmp_path / "a.dae"
    file.write_bytes(data)
    (part,) = load_mesh(file)
    assert part.texture == f"{tmp_path}/../my wood.png"
    assert part.color == (1, 1, 1, 1)
    absolute = data.replace(b"../my%20wood.png", b"file:///a/b.png")
    assert one(absolute, "a.dae").texture == "file:///a/b.png"
    missing = one(data.replace(b'id="image"', b'id="other"'), "a.dae")
    assert missing.texture is None


def test_corners_share_vertices() -> None:
    body = "<vcount>3 3</vcount><p>0 0 0 1 0 1 2 0 2 0 0 0 2 0 2 3 0 1</p>"
    part = one(collada(geometries=geometry(element(body=body))), "a.dae")
    assert len(part.positions) == 4
    assert part.indices is not None
    assert corners(part, "uv") == [[0, 1], [1, 1], [1, 0], [0, 1], [1, 0], [1, 1]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<p>0 0 0 1", "<p>0 0 0 4", r"index 4 of POSITION, of which there are 4"),
        ("<p>0 0 0 1", "<p>0 0 0 -1", r"index -1 of POSITION"),
        ("<p>0 0 0 1 0", "<p>0 0 0 1 1", r"index 1 of NORMAL, of which there are 1"),
        ("<p>0 0 0 1", "<p>0 0 1", r"11 indices; expected a multiple of 3"),
        ("<vcount>4", "<vcount>5", r"does not count the 4 corners"),
        ("<vcount>4", "<vcount>-4 8", r"does not count the 4 corners"),
        ("<vcount>4</vcount>", "", r"<polylist> has no <vcount>"),
        ("<vcount>4", "<vcount>four", r"<vcount> contains something other than numbers"),
        ('count="4" stride="3"', 'count="5" stride="3"', r"more than the 12 numbers there are"),
        ('count="4" stride="3"', 'count="999999999999" stride="3"', r"more than the 12 numbers"),
        ('count="4" stride="3"', 'count="4" stride="0"', r"fewer than 3 for each vertex"),
        ('count="4" stride="3"', 'count="-1" stride="3"', r"more than the 12 numbers"),
        (SQUARE, "0 0 0 100 nan 0 100 100 0 0 100 0", r"vertex 1 is not finite: \[100.0, nan, 0"),
        (SQUARE, "0 0 0 1e40 0 0 100 100 0 0 100 0", r"vertex 1 is not finite: \[inf"),
        (SQUARE, "0 0 0 1;5 0 0 100 100 0 0 100 0", r"<float_array> contains something other"),
        ('url="#square"', 'url="#round"', r"url of <instance_geometry>: there is no '#round'"),
        ('url="#square"', 'url="other.dae#square"', r"there is no 'other.dae#square' in the file"),
        ('url="#scene"', 'url="#seen"', r"there is no '#seen'"),
        ('semantic="POSITION"', 'semantic="COLOR"', r"<polylist> has no POSITION"),
        ('offset="2"', 'offset="2000000000"', r"an offset from 0 to 63"),
        ("<visual_scene", "<node><matrix>1</matrix></node><visual_scene", None),
        ('<node id="">', '<node id=""><matrix>1 2 3</matrix>', r"expected 16 finite numbers"),
        ('<node id="">', '<node id=""><rotate>0 0 1 nan</rotate>', r"expected 4 finite numbers"),
        ("<COLLADA", "<x3d", r"a\.dae:.*mismatched tag"),
        ("<vcount>4</vcount>", "&bomb;", r"<polylist> has no <vcount>"),
        ("<COLLADA", "<!DOCTYPE a><COLLADA", r"a document type .* is not allowed"),
        ("instance_geometry", "instance_light", r"no triangles"),
    ],
)
def test_broken_collada(old: str, new: str, message: str | None) -> None:
    data = collada().decode()
    assert old in data
    data = data.replace(old, new)
    if message is None:
        load_mesh(data.encode(), "a.dae")
        return
    with pytest.raises(MeshError, match=message) as caught:
        load_mesh(data.encode(), "a.dae")
    assert str(caught.value).startswith("a.dae:")


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("<?xml", "\n<?xml", "2: .*declaration not at start"),
        ("<?xml", "<!-- a\n --> <!-- b --><?xml", "2: .*declaration not at start"),
        ("<?xml", "\n\ufeff<?xml", "2: "),
        ("<COLLADA", "<!-- a -- b --><COLLADA", "2: .*invalid token"),
        ("<COLLADA", "<!--- a ---><COLLADA", "2: .*invalid token"),
        ("<asset>", "<asset><author>M\udcfcller & Co&nbsp;</author>", "3: .*invalid token"),
        ("</COLLADA>", "</COLLADA>\n\0\0\0</mesh></COLLADA>", "7: .*invalid token"),
        ("</COLLADA>", "</COLLADA>rest", "6: .*junk after document element"),
        ("<asset>", "<!-- a -- b --><asset>\udcfc&x", "3: .*invalid token"),
    ],
)
def test_xml_that_rviz_reads_as_well(
    old: str, new: str, fault: str, caplog: pytest.LogCaptureFixture
) -> None:
    text = collada().decode()
    assert old in text
    data = text.replace(old, new).encode("utf-8", "surrogateescape")
    assert corners(one(data, "a.dae")) == corners(one(text.encode(), "a.dae"))
    (record,) = caplog.records
    assert re.fullmatch(rf"a\.dae:{fault}.*it is read anyway", record.getMessage(), re.DOTALL)


def test_many_comments_take_no_time() -> None:
    for text in ("<!-- -- -->" * 200_000, "<!--" * 500_000, "<!-- -->" * 200_000, " \n" * 10**6):
        with pytest.raises(MeshError, match=r"a\.dae"):
            load_mesh(text.encode(), "a.dae")


def test_two_geometries_with_the_same_ids_of_sources() -> None:
    geometries = geometry() + geometry(positions="0 0 5 100 0 5 100 100 5 0 100 5", key="other")
    parts = load_mesh(collada(node() + node(target="other"), geometries), "a.dae")
    assert sorted({corner[2] for part in parts for corner in corners(part)}) == [0, 5]
    # An id may name a node, a geometry and a material at once, too.
    parts = load_mesh(collada(node(key="square"), geometry()), "a.dae")
    assert sum(part.triangles for part in parts) == 2


#: Materials whose first one by name is not the first in the file; checked with assimp 5.2.4.
SEVERAL = "".join(
    effect(f"<diffuse><color>{color} 1</color></diffuse>", key=key)
    for key, color in (("zz", "1 0 0"), ("aa", "0 1 0"), ("mm", "0 0 1"))
)


@pytest.mark.parametrize(
    ("symbol", "bound", "color"),
    [
        ("x", {}, (0, 1, 0)),
        ("mm-m", {}, (0, 0, 1)),
        ("x", {"zz": "zz-m", "b": "mm-m"}, (0, 0, 1)),
        ("zz", {"zz": "zz-m", "b": "mm-m"}, (1, 0, 0)),
        ("x", {"x": "nope"}, (0, 1, 0)),
        ("x", {"zz": "zz-m", "a": "nope"}, (0, 1, 0)),
    ],
)
def test_material_that_is_not_bound(
    symbol: str, bound: dict[str, str], color: tuple[float, ...]
) -> None:
    bindings = "".join(
        f'<instance_material symbol="{key}" target="#{value}"/>' for key, value in bound.items()
    )
    shown = node().replace(
        "</instance_geometry>",
        f"<bind_material><technique_common>{bindings}</technique_common></bind_material>"
        "</instance_geometry>",
    )
    data = collada(shown, geometry(element(material=symbol)), SEVERAL)
    assert one(data, "a.dae").color == (*color, 1)


def test_nodes_that_contain_themselves() -> None:
    loop = '<node id="n"><instance_node url="#n"/></node>'
    with pytest.raises(MeshError, match="nodes that contain themselves"):
        load_mesh(collada(loop), "a.dae")
    # 2^60 triangles in 60 nodes.
    levels = "".join(
        f'<node id="n{i}"><instance_node url="#n{i + 1}"/><instance_node url="#n{i + 1}"/></node>'
        for i in range(60)
    )
    levels += node(key="n60")
    with pytest.raises(MeshError, match="more than 100000 nodes"):
        load_mesh(collada(node(target="") + levels), "a.dae")


def test_too_many_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(triangles, "MAX_TRIANGLES", 3)
    for data, name in (
        (stl([TRIANGLE] * 4), "a.stl"),
        (collada(node() + node()), "a.dae"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * 4, "a.obj"),
    ):
        with pytest.raises(MeshError, match=rf"{name}: more than 3 triangles; reduce the mesh"):
            load_mesh(data, name)


def test_wrong_count_allocates_no_memory() -> None:
    lie = bytes(80) + struct.pack("<I", 0xFFFFFFFF) + bytes(5000)
    tracemalloc.start()
    with pytest.raises(MeshError, match=r"5084 bytes, too few for 4294967295 triangles"):
        load_mesh(lie, "a.stl")
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


# -- OBJ -------------------------------------------------------------------------------------------

OBJ = """# a comment
mtllib box.mtl
o box
v 0 0 0
v 1 0 0 0.5 0.5 0.5
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0 0
vt 1 1
vn 0 0 1
usemtl wood
f 1/1/1 2/2/1 3/3/1
usemtl red
f 1//1 3//1 4//1
f -4 -3 \\
  -2
usemtl missing
f 1 2 3 4
l 1 2
"""
MTL = """newmtl red
Kd 1 0 0
d 0.5
newmtl wood
Kd 0.1 0.2 0.3
Tr 0.25
map_Kd -s 2 2 2 -clamp on my wood.png
"""


def test_obj(tmp_path: Path) -> None:
    (tmp_path / "box.mtl").write_text(MTL)
    (tmp_path / "box.obj").write_text(OBJ)
    wood, red, plain = load_mesh(tmp_path / "box.obj")
    assert wood.color == pytest.approx((0.1, 0.2, 0.3, 0.75))
    assert wood.texture == f"{tmp_path}/my wood.png"
    assert corners(wood) == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert corners(wood, "uv") == [[0, 1], [1, 1], [1, 0]]
    assert (red.color, red.texture, red.triangles) == ((1, 0, 0, 0.5), None, 2)
    assert corners(red) == [[0, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0]]
    assert (plain.color, plain.triangles) == (None, 2)
    assert all(
        part.normals[:, 2].tolist() == [1] * len(part.normals) for part in (wood, red, plain)
    )


def test_obj_without_its_materials(caplog: pytest.LogCaptureFixture) -> None:
    parts = load_mesh(OBJ.replace("\n", "\r\n").encode(), "package://no_package/box.obj")
    assert sum(part.triangles for part in parts) == 5
    assert "package 'no_package'" in caplog.text


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 0\nf 1 2 3\n", r"an index of v that is not from 1 to 1"),
        ("v 0 0 0\nf 1 1 0\n", r"an index of v that is not from 1 to 1"),
        ("v 0 0 0\nf -2 -1 -1\n", r"an index of v that is not from 1 to 1"),
        ("v 0 0 0\nf 1/1 1/1 1/1\n", r"an index of vt that is not from 1 to 0"),
        ("v 0 0 0\nf 1//1 1//1 1//1\n", r"an index of vn that is not from 1 to 0"),
        ("v 0 0 x\nf 1 1 1\n", r"a line that begins with v contains something other than numbers"),
        ("v 0 0 nan\nf 1 1 1\n", r"vertex 0 is not finite"),
        ("v 0 0 0\nf 1/x 1/x 1/x\n", r"a face is not of the form"),
        ("v 0 0 0\nf a b c\n", r"a face is not of the form .*'a b c'"),
        ("v 0 0 0\nf 1/1/1/1 1/1/1/1 1/1/1/1\n", r"."),
        ("v 0 0 0\nf 1 1\n", r"no triangles"),
        ("", r"no triangles"),
        ("\x00" * 1000, r"no triangles"),
    ],
)
def test_broken_obj(text: str, message: str) -> None:
    with pytest.raises(MeshError, match=rf"a\.obj: .*{message}|{message}"):
        load_mesh(text.encode(), "a.obj")


@pytest.mark.parametrize(
    "face", ["f\t1 2 3", "f 1/ 2/ 3/", "f\t1/\t2/\t3/", "f 1// 2// 3//", "f 1/1/ 2/1/ 3/1/"]
)
def test_faces_as_assimp_reads_them(face: str) -> None:
    text = f"v\t0 0 0\nv 1\t0 0\n  v 0 2 0\nvt 0 0\n{face}\r\n"
    assert corners(one(text.encode(), "a.obj")) == TRIANGLE


def test_materials_of_obj_files_with_tabs(tmp_path: Path) -> None:
    (tmp_path / "box.mtl").write_text("newmtl\tred\n\tKd\t1 0 0\n")
    text = "mtllib\tbox.mtl\nusemtl\tred\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf\t1 2 3\n"
    (tmp_path / "box.obj").write_text(text)
    (part,) = load_mesh(tmp_path / "box.obj")
    assert part.color == (1, 0, 0, 1)


def test_vertices_of_different_lengths() -> None:
    part = one(b"v 0 0 0\nv 1 0 0 1 1 1\nv 0 2\nf 1 2 3\n", "a.obj")
    assert corners(part) == TRIANGLE


# -- glTF, PLY and OFF -----------------------------------------------------------------------------


def glb(document: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf_document(**more: Any) -> dict[str, Any]:
    points = np.array(TRIANGLE, np.float32)
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 0, 10]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": points.min(0).tolist(),
                "max": points.max(0).tolist(),
            },
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"byteLength": 44}],
    } | more


GLTF_BINARY = np.array(TRIANGLE, "<f4").tobytes() + struct.pack("<3H", 0, 1, 2)


def test_glb_is_turned_to_z_up() -> None:
    pytest.importorskip("trimesh", reason="glTF needs trimesh: pip install rosglass[scene]")
    part = one(glb(gltf_document(), GLTF_BINARY), "a.glb")
    assert corners(part) == [[0, -10, 0], [1, -10, 0], [0, -10, 2]]
    assert part.normals.tolist() == [[0, -1, 0]] * 3
    assert part.color == (1, 0, 0, 1)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"nodes": [{"children": [0]}]}, "the nodes do not form a tree"),
        ({"nodes": [{"children": [1, 1]}, {"mesh": 0}]}, "the nodes do not form a tree"),
        ({"accessors": [{"count": 1 << 40, "componentType": 5126, "type": "VEC3"}]}, "accessor 0"),
        ({"accessors": [{"count": -1, "bufferView": 0}]}, "accessor 0"),
        ({"accessors": [{"count": 1, "bufferView": 9}]}, "corrupt"),
        ({"nodes": 5}, "corrupt"),
        ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "compressed glTF"),
        (
            {"accessors": [gltf_document()["accessors"][0] | {"normalized": True}]},
            r"quantised glTF is not read; save it with floats",
        ),
        (
            {
                "extensionsRequired": ["KHR_mesh_quantization"],
                "bufferViews": [
                    {"buffer": 0, "byteLength": 20, "byteStride": 12},
                    {"buffer": 0, "byteOffset": 36, "byteLength": 6},
                ],
            },
            r"trimesh gives no reason \(AssertionError\); quantised glTF is not read",
        ),
    ],
)
def test_hostile_gltf(more: dict[str, Any], message: str) -> None:
    pytest.importorskip("trimesh", reason="glTF needs trimesh: pip install rosglass[scene]")
    with pytest.raises(Error, match=rf"a\.glb: .*{message}"):
        load_mesh(glb(gltf_document(**more), GLTF_BINARY), "a.glb")


@pytest.mark.parametrize("length", [0, 4, 12, 20, 60, 400])
def test_glb_that_is_cut_off(length: int) -> None:
    pytest.importorskip("trimesh", reason="glTF needs trimesh: pip install rosglass[scene]")
    with pytest.raises(MeshError, match=r"a\.glb"):
        load_mesh(glb(gltf_document(), GLTF_BINARY)[:length], "a.glb")


PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 2 0
3 0 1 2
"""


def test_ply_and_off() -> None:
    pytest.importorskip("trimesh", reason="PLY needs trimesh: pip install rosglass[scene]")
    assert corners(one(PLY.encode(), "a.ply")) == TRIANGLE
    assert corners(one(b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n", "a.off")) == TRIANGLE
    for text, name in (
        (PLY.replace("vertex 3", "vertex 4000000000"), "a.ply"),
        ("OFF\n4000000000 1 0\n0 0 0\n", "a.off"),
    ):
        with pytest.raises(MeshError, match="too few for what its header declares"):
            load_mesh(text.encode(), name)
    with pytest.raises(MeshError, match=r"a\.ply"):
        load_mesh(PLY.replace("3 0 1 2", "3 0 1 7").encode(), "a.ply")


def test_format_whose_library_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(UnsupportedError, match=r"a\.glb: glb files need trimesh: pip install"):
        load_mesh(b"glTF", "a.glb")


# -- files and the cache ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a.fbx", "a", "a.dae.zip", "a.mesh"])
def test_unknown_formats(name: str) -> None:
    with pytest.raises(UnsupportedError, match="is not a supported format; convert"):
        load_mesh(b"data", name)


def test_missing_and_special_files_are_rejected(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"a\.stl: the mesh can't be read: .*No such file"):
        load_mesh(tmp_path / "a.stl")
    with pytest.raises(MeshError, match="this is not a file"):
        load_mesh(tmp_path)
    with pytest.raises(MeshError, match="this is not a file"):
        load_mesh("/dev/zero", "a.stl")
    with pytest.raises(ArgumentError, match=r"name: expected name of the mesh file"):
        load_mesh(b"data")
    with (tmp_path / "b.stl").open("wb") as file:
        file.truncate(600 << 20)
    with pytest.raises(MeshError, match=r"629145600 bytes; the limit is"):
        load_mesh(tmp_path / "b.stl")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "rosglass" / "meshes"


def same(one: Sequence[MeshPart], other: Sequence[MeshPart]) -> bool:
    return len(one) == len(other) and all(
        (a.color, a.texture) == (b.color, b.texture)
        and all(
            np.array_equal(getattr(a, name), getattr(b, name))
            if getattr(a, name) is not None
            else getattr(b, name) is None
            for name in ("positions", "normals", "uv", "indices")
        )
        for a, b in zip(one, other, strict=True)
    )


def forbid_parsing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "_parsed", lambda *_: pytest.fail("it was parsed again"))


def test_cache_returns_parsed_mesh(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    materials = effect('<diffuse><texture texture="image"/></diffuse>')
    materials += '<image id="image"><init_from>wood.png</init_from></image>'
    data = collada(node(material="effect-m") + node("<scale>2 2 2</scale>"), materials=materials)
    parsed = load_mesh_cached(data, "file:///a/b.dae")
    load_mesh_cached(stl(TRIANGLE), "b.stl")
    assert len(list(cache.iterdir())) == 2
    elsewhere = load_mesh_cached(data, "file:///c/b.dae")  # with a texture of its own
    assert (parsed[0].texture, elsewhere[0].texture) == ("file:///a/wood.png", "file:///c/wood.png")
    embedded = [MeshPart(parsed[0].positions, parsed[0].normals, texture=b"\x89PNG")]
    meshes.MeshCache(os.fspath(cache)).put("embedded", embedded)
    forbid_parsing(monkeypatch)
    assert same(load_mesh_cached(data, "file:///a/b.dae"), parsed)
    assert same(meshes.MeshCache(os.fspath(cache)).get("embedded") or (), embedded)


def test_cache_follows_the_materials_of_obj_files(cache: Path, tmp_path: Path) -> None:
    file = tmp_path / "box.obj"
    file.write_text(OBJ)
    (tmp_path / "box.mtl").write_text(MTL)
    assert (load_mesh_cached(file)[1].color or ())[:3] == (1, 0, 0)
    (tmp_path / "box.mtl").write_text(MTL.replace("Kd 1 0 0", "Kd 0 1 0"))
    assert (load_mesh_cached(file)[1].color or ())[:3] == (0, 1, 0)
    assert len(list(cache.iterdir())) == 2


@pytest.mark.parametrize("damage", ["empty", "cut", "bytes", "pickle", "arrays", "index"])
def test_damaged_entries_are_parsed_again(cache: Path, damage: str) -> None:
    data = collada()
    parsed = load_mesh_cached(data, "a.dae")
    (entry,) = cache.iterdir()
    content = entry.read_bytes()
    arrays = dict(np.load(entry))
    if damage == "empty":
        entry.write_bytes(b"")
    elif damage == "cut":
        entry.write_bytes(content[: len(content) // 2])
    elif damage == "bytes":
        entry.write_bytes(bytes(byte ^ 0x5A for byte in content))
    elif damage == "pickle":
        with entry.open("wb") as file:
            np.savez(file, **arrays | {"positions0": np.array([object()])})
    elif damage == "arrays":
        with entry.open("wb") as file:
            np.savez(file, **arrays | {"normals0": arrays["normals0"][:1]})
    else:
        with entry.open("wb") as file:
            np.savez(file, **arrays | {"indices0": arrays["indices0"] + 100})
    assert same(load_mesh_cached(data, "a.dae"), parsed)
    (entry,) = cache.iterdir()
    assert same(meshes.MeshCache(os.fspath(cache)).get(entry.stem) or (), parsed)


def test_compressed_entry_is_not_unpacked(cache: Path) -> None:
    parsed = load_mesh_cached(collada(), "a.dae")
    (entry,) = cache.iterdir()
    arrays = dict(np.load(entry)) | {"positions0": np.zeros((1 << 22, 3), np.float32)}
    with entry.open("wb") as file:
        np.savez_compressed(file, **arrays)
    del arrays
    tracemalloc.start()
    assert same(load_mesh_cached(collada(), "a.dae"), parsed)
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()


def test_old_entries_make_room(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = [stl([np.array(TRIANGLE) + i] * 100) for i in range(4)]
    monkeypatch.setattr(meshes, "_MAX_CACHE_BYTES", 2 * 9000)
    seen: list[str] = []
    for age, data in enumerate(files[:2]):
        load_mesh_cached(data, "a.stl")
        (new,) = {entry.name for entry in cache.iterdir()} - set(seen)
        seen.append(new)
        os.utime(cache / new, (age, age))
    load_mesh_cached(files[0], "a.stl")  # which makes it the newest
    load_mesh_cached(files[2], "a.stl")
    left = {entry.name for entry in cache.iterdir()}
    assert seen[0] in left
    assert seen[1] not in left
    assert sum(entry.stat().st_size for entry in cache.iterdir()) < 3 * 9000
    load_mesh_cached(stl([TRIANGLE] * 1000), "a.stl")  # too large to be kept
    assert {entry.name for entry in cache.iterdir()} == left


def test_many_threads_write_the_same_entry(cache: Path) -> None:
    data = collada()
    expected = load_mesh(data, "a.dae")
    failed: list[Any] = []

    def work() -> None:
        for _ in range(20):
            if not same(load_mesh_cached(data, "a.dae"), expected):
                failed.append(1)
            for entry in list(cache.iterdir()):
                entry.unlink(missing_ok=True)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed


def test_folder_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert load_mesh_cached(stl(TRIANGLE), "a.stl")[0].triangles == 1


# -- anything at all -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a.stl", "a.dae", "a.obj"])
def test_damaged_files_raise_mesh_errors_only(name: str) -> None:
    good = {
        "a.stl": stl([TRIANGLE] * 3),
        "a.dae": collada(
            node(material="effect-m"), materials=effect("<diffuse><color>1 0 0 1</color></diffuse>")
        ),
        "a.obj": OBJ.encode(),
    }[name]
    random = np.random.default_rng(7)
    for _ in range(400):
        data = bytearray(good)
        for _ in range(random.integers(1, 6)):
            at = int(random.integers(len(data)))
            if random.random() < 0.3:
                del data[at : at + int(random.integers(1, 40))]
            else:
                data[at] = int(random.integers(256))
        try:
            parts = load_mesh(bytes(data), name)
        except Error:
            continue
        for part in parts:
            assert np.isfinite(part.positions).all()
            assert np.isfinite(part.normals).all()
            assert part.indices is None or part.indices.max() < len(part.positions)


@pytest.mark.parametrize("count", [10, 1000])
def test_vertices_of_other_parts_are_left_out(count: int) -> None:
    positions = np.arange(3 * count, dtype=np.float32).reshape(-1, 3)
    normals = np.tile(np.array((0, 1, 0), np.float32), (count, 1))
    corners = np.array([7, 5, 9, 5, 7, 8])
    part = triangles.assemble(positions, normals, positions[:, :2], (corners,) * 3)
    assert part.positions.tolist() == positions[[5, 7, 8, 9]].tolist()
    assert part.indices is not None
    assert part.uv is not None
    assert part.indices.tolist() == [1, 0, 3, 0, 1, 2]
    assert part.uv.tolist() == positions[[5, 7, 8, 9], :2].tolist()


def test_polygons_that_are_not_convex_are_cut_in_their_place() -> None:
    square, arrow = [[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 0], [2, 0], [0.5, 0.5], [0, 2]]
    points = np.zeros((12, 3), np.float32)
    points[:, :2] = [*square, *arrow, *square]
    cut = triangles.triangulate(np.array([4, 4, 4]), points).reshape(-1, 3)
    assert cut[[0, 1, 4, 5]].tolist() == [[0, 1, 2], [0, 2, 3], [8, 9, 10], [8, 10, 11]]
    # Along the diagonal that is inside.
    assert {6, 4} <= set(cut[2].tolist()) & set(cut[3].tolist())
