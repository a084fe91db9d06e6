"""Search for contact sequences by complementarity.

A homotopy of relaxed problems proposes closed sequences for an open one; these candidates are then solved as smooth
problems.
"""
