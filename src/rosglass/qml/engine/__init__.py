"""What every interface runs on: its session, the runtime of an engine, values and callbacks."""
