"""What nodes talk over: each wire announces endpoints and moves bytes."""
