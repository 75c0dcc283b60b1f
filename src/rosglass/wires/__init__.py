"""The wires under a node: each announces endpoints and transfers bytes."""
