"""QML interfaces over a ``SceneView``, and its camera under the control of robots and keys."""
