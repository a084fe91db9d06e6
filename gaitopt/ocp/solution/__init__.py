"""The solution of one gait problem from one initial guess.

Coarse grids are solved first, the mesh is refined until the plan is accurate between its nodes, and the plan is
extracted and checked.
"""
