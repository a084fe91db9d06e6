"""Calls of all public names with odd values, from fixed seeds."""
