"""Frozen results: problems and studies whose results are stored and computed again.

Changes of the stored numbers
-----------------------------
Absolute work is minimised and reported exactly; before, it was the trapezoidal rule at the collocation points, off by
up to 2 % in these problems.  Results that minimise a work, or start from such a gait, were computed again.  In
results of other objectives only `cost_of_transport` was replaced, by at most 6e-5: the zeros of the powers of a plan
are located.  Their motions and objectives are as before.

Problem 32, whose slip starts from rest after a sticking impact, was computed again when the sticking force there was
required to be outside the friction cone by the margin: its objective changed by 2e-6 of its value.

The search, the warm start of a cost of transport and the problems 20, 56, 58, 59 and 61 were computed again when
several starts became the default and warm starts were solved by sequential quadratic programming: the lowest cost of
the search is 7e-4 lower and that of problem 20 is 3e-3 lower; the others differ by at most 8e-8, the accuracy of Ipopt.

Problem 47 was computed again when finer grids began to start from the motion of coarser ones: its objective is 2.9e-8
lower, the value to which the code before that change converges too with a tolerance of 1e-9 instead of 1e-8.
"""
