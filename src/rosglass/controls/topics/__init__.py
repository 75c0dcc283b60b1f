"""Subscriptions of controls, recordings, and the graph."""
