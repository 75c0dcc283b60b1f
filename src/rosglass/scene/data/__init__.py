"""Robots, meshes and point clouds as files and messages have them, read into numpy arrays."""
