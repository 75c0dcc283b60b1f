"""The displays of RViz, and the scene that they fill."""
