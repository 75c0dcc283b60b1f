"""The drawing of a scene: drawables, cameras, the renderer on the GPU, picking."""
