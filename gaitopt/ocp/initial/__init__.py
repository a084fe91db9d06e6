"""Initial points of the solver.

An initial point is a guess, or the solution on another grid or of a nearby problem, whose cost can be predicted.
"""
