"""The displays of RViz, one module for each family."""
