"""Samples, and how they are drawn over time."""
