"""Continuation of optimal gaits: optimality conditions over a parameter, with changes of the active constraints."""
