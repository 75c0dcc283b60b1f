"""The base of every interface: its session, the runtime of an engine, values and callbacks."""
