"""Gaits of several different steps, from a given state, to a given state, or periodic after several steps."""
