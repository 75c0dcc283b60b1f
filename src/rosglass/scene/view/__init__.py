"""The ``SceneView``, the QML item that shows a scene."""
