"""The tools of RViz, which get the mouse, and the selection."""
