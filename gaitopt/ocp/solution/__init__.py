"""The solution of one gait problem from one initial guess.

It is approached through coarse grids, the mesh is refined until the plan is accurate between its nodes, and the plan is
read out and checked.
"""
