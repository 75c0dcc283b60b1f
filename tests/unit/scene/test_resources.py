"""Files that robot descriptions name: packages, URIs, and images of any size."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import pytest

from rosglass.errors import ArgumentError, Error, UnsupportedError
from rosglass.scene.data.resources import ResourceError, check_texture, locate_resource

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    package = tmp_path / "src" / "my_arm"
    file = package / "meshes" / "upper arm.stl"
    file.parent.mkdir(parents=True)
    file.touch()
    (package / "package.xml").write_text("<package><name>my_arm</name></package>")
    for variable in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return file


def test_resources_are_found_by_uri_and_path(
    mesh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert locate_resource("package://my_arm/meshes/upper arm.stl") == mesh
    assert locate_resource(mesh.as_uri()) == mesh  # with %20
    assert locate_resource(f"file://localhost{mesh}") == mesh
    assert locate_resource(str(mesh)) == mesh
    assert locate_resource(f" {mesh}\n") == mesh
    assert locate_resource("meshes/upper arm.stl", base=mesh.parents[1]) == mesh
    shared = tmp_path / "install" / "share" / "other" / "a.dae"
    shared.parent.mkdir(parents=True)
    shared.touch()
    (tmp_path / "install" / "share" / "ament_index").mkdir()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    assert locate_resource("package://other/a.dae") == shared


@pytest.mark.parametrize(
    ("uri", "error", "message"),
    [
        ("package://your_arm/a.stl", ResourceError, r"there is no package 'your_arm' in ROS_PACK"),
        ("package://my_arm", ResourceError, r"expected package://name/path"),
        ("package:///a.stl", ResourceError, r"there is no package|expected package"),
        (
            "package://my_arm/meshes/upper_arm.stl",
            ResourceError,
            r"^package://my_arm/meshes/upper_arm.stl: there is no such file; did you mean",
        ),
        ("package://my_arm/meshes", ResourceError, r"this is not a file"),
        ("a.stl", ResourceError, r"the path is relative; use package://"),
        ("file://robot/a.stl", ResourceError, r"'robot' is another machine"),
        ("http://x.org/a.stl", UnsupportedError, r"not loaded from web servers; download it"),
        ("HTTPS://x.org/a.stl", UnsupportedError, r"not loaded from web servers"),
        ("model://robot/a.stl", UnsupportedError, r"model: is not supported; use package://"),
        ("/a\0b.stl", ResourceError, r"null"),
        ("/dev/zero", ResourceError, r"/dev/zero: this is not a file"),
        ("/" + "x" * 5000, ResourceError, r"."),
        ("", ArgumentError, r"uri: expected package://name/path, file:///path or a path"),
        (5, ArgumentError, r"uri: expected"),
    ],
)
def test_files_that_are_not_there(mesh: Path, uri: str, error: type[Error], message: str) -> None:
    assert mesh.exists()
    with pytest.raises(error, match=message):
        locate_resource(uri)


def png(width: int, height: int) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", width, height) + bytes(9)


def jpeg(width: int, height: int) -> bytes:
    return b"\xff\xd8\xff\xc0" + struct.pack(">HBHH", 17, 8, height, width) + bytes(20)


def bmp(width: int, height: int) -> bytes:
    return b"BM" + bytes(12) + struct.pack("<Iii", 40, width, -height) + bytes(30)


def gif(width: int, height: int) -> bytes:
    return b"GIF89a" + struct.pack("<HH", width, height) + bytes(10)


def tga(width: int, height: int) -> bytes:
    return bytes((0, 0, 2)) + bytes(9) + struct.pack("<HHBB", width, height, 24, 0) + bytes(9)


def webp(width: int, height: int) -> bytes:
    return b"RIFF\0\0\0\0WEBPVP8 " + bytes(10) + struct.pack("<HH", width, height) + bytes(9)


def webp_extended(width: int, height: int) -> bytes:
    sides = (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(3, "little")
    return b"RIFF\0\0\0\0WEBPVP8X" + bytes(8) + sides + bytes(9)


def webp_lossless(width: int, height: int) -> bytes:
    bits = (width - 1) | (height - 1) << 14
    return b"RIFF\0\0\0\0WEBPVP8L" + bytes(5) + struct.pack("<I", bits) + bytes(19)


def size_of(picture: bytes) -> object:
    try:
        return check_texture(picture, "wood")
    except Error as error:
        return str(error)[:6]


@pytest.mark.parametrize("picture", [png, jpeg, bmp, gif, tga, webp, webp_extended, webp_lossless])
def test_sizes_of_images(picture, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    assert check_texture(picture(640, 480)) == (640, 480)
    file = tmp_path / "picture"
    file.write_bytes(picture(12, 34))
    assert check_texture(file) == check_texture(str(file)) == (12, 34)
    for cut in range(0, len(picture(640, 480)) - 10, 3):
        assert size_of(picture(640, 480)[:cut]) in {(640, 480), "wood: "}


@pytest.mark.parametrize("size", [(20_000, 20_000), (20_000, 1), (16_384, 16_384), (0, 5)])
def test_images_that_are_too_large(size: tuple[int, int]) -> None:
    message = rf"wood.png: the image is {size[0]}x{size[1]} pixels; the limits are .*; reduce it"
    for picture in (png(*size), size):
        with pytest.raises(ResourceError, match=message):
            check_texture(picture, "wood.png")
    assert check_texture((8192, 8192)) == (8192, 8192)


def test_invalid_texture_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedError, match=r"wood: this is not a PNG, .*; convert it to PNG"):
        check_texture(b"some text that is long enough", "wood")
    with pytest.raises(ResourceError, match="there is no such file"):
        check_texture(tmp_path / "missing.png")
    with pytest.raises(ResourceError, match="this is not a file"):
        check_texture("/dev/zero")
    with (tmp_path / "large.png").open("wb") as file:
        file.truncate(300 << 20)
    with pytest.raises(ResourceError, match="314572800 bytes; the limit is"):
        check_texture(tmp_path / "large.png")
