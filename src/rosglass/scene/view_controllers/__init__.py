"""RViz's view controllers, which move the camera by mouse, wheel and touch."""
