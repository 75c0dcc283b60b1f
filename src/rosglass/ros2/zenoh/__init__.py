"""The old place of :mod:`rosglass.wires.zenoh`."""
