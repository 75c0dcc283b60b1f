"""What a type is: interface definitions, where they come from, and their hashes."""
