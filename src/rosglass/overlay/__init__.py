"""Interfaces over a 3D view, independent of what draws the view.

Both 3D views, RViz (:mod:`rosglass.rviz`) and ``SceneView`` (:mod:`rosglass.scene`), derive their
own classes from those of this package; the object ``rviz`` in QML knows them by these only.
"""
