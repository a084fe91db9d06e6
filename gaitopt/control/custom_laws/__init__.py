"""Custom laws from a function that returns the torques as expressions, for robots with any contacts."""
