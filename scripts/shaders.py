"""Compiles the shaders of the 3D view: ``python scripts/shaders.py [--check]``.

Each ``NAME.vert`` and ``NAME.frag`` of ``scene/render/shaders`` becomes a ``.qsb`` beside it,
with which Qt draws on OpenGL, Vulkan, Metal and Direct3D. ``pyside6-qsb`` comes with
PySide6-Addons; only developers need it. ``--check`` compares with what is there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "src/rosglass/scene/render/shaders"
#: GLSL for OpenGL 3.3 and OpenGL ES 3.0, Direct3D 11, Metal 1.2; SPIR-V for Vulkan is always in.
_TARGETS = ("--glsl", "330,300 es", "--hlsl", "50", "--msl", "12")
#: Shaders that need the colours of points as well.
_OF_POINTS = ("points.vert", "quads.vert", "sprites.vert", "boxes.vert")
#: Shaders of squares that have an edge.
_WITH_EDGES = ("squares.frag", "sprites.frag")


def source_of(file: Path) -> str:
    """Return the whole text of a shader."""
    shared = ["frame.glsl"]
    shared += ["points.glsl"] if file.name in _OF_POINTS else []
    shared += ["edges.glsl"] if file.name in _WITH_EDGES else []
    parts = [(FOLDER / name).read_text(encoding="utf-8") for name in shared]
    return "\n".join(["#version 440", *parts, file.read_text(encoding="utf-8")])


def compile_shader(file: Path, out: Path) -> None:
    """Compile one shader."""
    with tempfile.TemporaryDirectory() as folder:
        text = Path(folder, file.name)
        text.write_text(source_of(file), encoding="utf-8")
        qsb = Path(sys.executable).with_name("pyside6-qsb")
        subprocess.run([qsb, *_TARGETS, "-o", out, text], check=True)


def main() -> int:
    """Compile all, or check that what is there is up to date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 if old")
    check = parser.parse_args().check
    old = []
    for file in sorted([*FOLDER.glob("*.vert"), *FOLDER.glob("*.frag")]):
        target = file.with_name(f"{file.name}.qsb")
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder, target.name)
            compile_shader(file, made)
            data = made.read_bytes()
        if not target.exists() or target.read_bytes() != data:
            old.append(target.name)
            if not check:
                target.write_bytes(data)
    if old:
        print(f"{'out of date' if check else 'compiled'}: {', '.join(old)}")
    return int(check and bool(old))


if __name__ == "__main__":
    sys.exit(main())
