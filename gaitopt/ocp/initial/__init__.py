"""Initial points of the solver.

They come from a guess or from the solution on another grid or of a nearby problem, whose cost can be predicted.
"""
