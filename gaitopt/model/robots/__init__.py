"""Built-in robots, one file each, and their catalogue by name."""
