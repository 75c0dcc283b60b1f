"""The demo: a simulated robot in a process of its own, and the cockpit that shows and drives it."""
