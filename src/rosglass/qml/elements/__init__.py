"""The types that QML imports: elements, and the singletons of each module."""
