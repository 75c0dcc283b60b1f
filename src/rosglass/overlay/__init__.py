"""What an interface over a 3D view is, whatever draws the view.

Both 3D views, RViz (:mod:`rosglass.rviz`) and ``SceneView`` (:mod:`rosglass.scene`), derive their
own classes from those of this package; the object ``rviz`` in QML knows them by these only.
"""
