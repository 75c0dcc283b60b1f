"""The 3D view: RViz's job in QML, for ROS 2 and ROS 1, wherever PySide6 runs."""
