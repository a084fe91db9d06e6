"""Contact with Coulomb friction as a linear complementarity problem, solved by Lemke's method.

w = A z + b, 0 <= w _|_ z >= 0.  Of each contact the normal force; of each group the two parts of the tangential force
f_t = p - m and the slip speed c (Stewart and Trinkle 1996; Anitescu and Potra 1997):

    0 <= f_n _|_ y_n >= 0      0 <= p _|_ c + y_t >= 0      0 <= m _|_ c - y_t >= 0
    0 <= c _|_ sum(mu f_n) - p - m >= 0
"""

import numpy as np


def solve_contacts(mobility, constant, members, friction, k):
    """Return the forces (k normal, then one tangential of each group) with y = constant + mobility force."""
    groups = len(members)
    size = k + 3 * groups
    spread = np.zeros((k + groups, size))
    spread[:k, :k] = np.eye(k)
    matrix = np.zeros((size, size))
    for group in range(groups):
        plus, minus, slip = k + 3 * group + np.arange(3)
        spread[k + group, plus], spread[k + group, minus] = 1, -1
        matrix[[plus, minus], slip] = 1
        matrix[slip, [plus, minus]] = -1
        matrix[slip, :k] = [friction if number in members[group] else 0 for number in range(k)]
    z = lemke(matrix + spread.T @ mobility @ spread, spread.T @ constant)
    return spread @ z


def lemke(matrix, vector, limit=500):
    """Return z >= 0 with w = matrix z + vector >= 0 and w z = 0; ties of ratios are broken by lexicographic order."""
    n = len(vector)
    if (vector >= 0).all():
        return np.zeros(n)
    tableau = np.hstack((np.eye(n), -matrix, -np.ones((n, 1)), vector[:, None]))
    basis = list(range(n))
    row = int(np.argmin(vector))
    entering = 2 * n
    for _ in range(limit):
        leaving, basis[row] = basis[row], entering
        tableau[row] /= tableau[row, entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, entering], tableau[row])
        if leaving == 2 * n:
            break
        entering = leaving + n if leaving < n else leaving - n
        column = tableau[:, entering]
        eligible = np.flatnonzero(column > 1e-11)
        assert eligible.size, "a ray: no solution was found"
        ratios = tableau[eligible, -1] / column[eligible]
        tied = eligible[ratios <= ratios.min() + 1e-13]
        order = np.lexsort((tableau[tied, :n] / column[tied, None]).T[::-1])
        row = next((int(i) for i in tied if basis[i] == 2 * n), int(tied[order[0]]))
    z = np.zeros(2 * n + 1)
    z[basis] = tableau[:, -1]
    return z[n : 2 * n]
