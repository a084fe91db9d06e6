"""Gaits of several steps that differ: started from a state, ended in a state, or periodic after several steps."""
