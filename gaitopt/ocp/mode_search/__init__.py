"""Search for contact sequences by complementarity.

A homotopy of relaxed problems proposes sequences for what an open sequence leaves unspecified; the candidates are then
solved as smooth problems.
"""
