"""Rendering by OpenGL alone; test_rendering_opengl.py runs it, in an RViz of its own."""

from __future__ import annotations

from typing import Any


def colour(picture: Any, x: float, y: float) -> tuple[int, int, int]:
    return tuple(picture.pixelColor(round(x), round(y)).getRgb()[:3])


def test_opengl_is_used_as_it_was_asked_for(show: Any, drawn: list[Any], frames: Any) -> None:
    from rosglass.rviz.rendering import choice

    show('Rectangle { width: 60; height: 60; color: "red" }')
    frames(3)
    assert choice.renderer == "opengl"
    assert drawn[-1].read_back > 0


def test_shaders_are_drawn(show: Any, grab: Any) -> None:
    show(
        """Item {
        ShaderEffect { x: 140; y: 200; width: 60; height: 60
            fragmentShader: "varying highp vec2 qt_TexCoord0; uniform lowp float qt_Opacity;
                void main() { gl_FragColor = vec4(0.0, 1.0, 0.0, 1.0) * qt_Opacity; }" }
        }"""
    )
    assert colour(grab(), 170, 230) == (0, 255, 0)


def test_layers_are_drawn_without_holes_below_them(show: Any, grab: Any) -> None:
    show(
        """Rectangle { width: 300; height: 300; color: "#0080ff"
        Item { x: 40; y: 40; width: 60; height: 60; layer.enabled: true; opacity: 0.5
            Rectangle { width: 30; height: 60; color: "#0080ff" } }
        }"""
    )
    picture = grab()
    assert colour(picture, 55, 70) == colour(picture, 85, 70) == (0, 128, 255)
