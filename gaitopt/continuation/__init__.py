"""Continuation of gaits over a parameter."""
