"""Runs QML files: modules, windows, live reload and whole programs."""
