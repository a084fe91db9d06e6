"""The assembled derivatives against CasADi's own of the same f and g, and against central differences."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import ContactSequence, CostOfTransport, GaitProblem, PositiveWork, TorqueSquared, compass_biped
from gaitopt.ocp.bounds import nlp_data
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.nlp import assemble_nlp
from gaitopt.ocp.statement.initial_guess import LinearGuess
from tests.ocp.nlp_examples import example_nlp

CASES = [
    ("stick | stick", (4,), TorqueSquared()),
    ("stick | stick", (3,), CostOfTransport()),
    ("slip+ stick | slip+", (3, 4), CostOfTransport()),
    ("slip+ stick slip- | slip+", (2, 3, 2), PositiveWork()),
    ("stick slip- | stick", (3, 2), TorqueSquared()),
    ("slip+ | slip+", (3,), TorqueSquared()),
]


def toy():
    """Return an NLP with shared rows, shared columns, and one column used twice by one instance."""
    z = ca.SX.sym("z", 1)
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    coupled = Block(
        name="coupled",
        variables=ca.vertcat(a, b),
        cost=a**2 * ca.sin(b),
        constraints=ca.vertcat(a * b**2, ca.exp(z * a)),
        columns=np.array([[0, 3, 2], [1, 0, 2]]),  # the last instance has a = b = x[2]; the second descends
        rows=np.array([[0, 1, 0], [2, 2, 1]]),  # rows are shared within and between instances
    )
    alone = Block(name="alone", variables=a, constraints=a**3, columns=np.array([[3]]), rows=np.array([[0]]))
    return assemble_nlp([coupled, alone], z, 4, 3), np.array([0.7])


def test_the_toy_nlp_is_the_sum_of_its_parts():
    nlp, z = toy()
    x = np.array([0.3, -0.8, 1.1, 0.5])
    f, g = values(nlp)(x, z)
    pairs = [(x[0], x[1]), (x[3], x[0]), (x[2], x[2])]
    assert float(f) == pytest.approx(sum(a**2 * np.sin(b) for a, b in pairs))
    by_hand = [x[0] * x[1] ** 2 + x[2] ** 3 + x[3] ** 3, x[3] * x[0] ** 2 + np.exp(0.7 * x[2])]
    by_hand.append(np.exp(0.7 * x[0]) + np.exp(0.7 * x[3]))
    assert np.asarray(g).ravel() == pytest.approx(by_hand)


def examples():
    yield "toy", *toy(), np.array([0.3, -0.8, 1.1, 0.5])
    for sequence, counts, objective in CASES:
        problem = _problem(sequence, objective)
        transcription = example_nlp(problem.sequence, counts, objective)
        x = initial_point(transcription, problem, LinearGuess())
        x += 0.05 * np.random.default_rng(len(x)).standard_normal(x.size)
        yield f"{sequence}, {objective.name}", transcription.nlp, nlp_data(transcription, problem), x


def _problem(sequence, objective):
    return GaitProblem(
        robot=compass_biped(),
        sequence=ContactSequence.parse(sequence),
        friction=0.14,
        speed=0.6,
        step_length=0.45,
        objective=objective,
    )


EXAMPLES = {name: rest for name, *rest in examples()}
every_nlp = pytest.mark.parametrize("name", EXAMPLES)


def values(nlp):
    return ca.Function("fg", [nlp.functions["x"], nlp.functions["p"]], [nlp.functions["f"], nlp.functions["g"]])


def own(nlp, x, z, weight, multipliers):
    f, gradient = nlp.derivatives["grad_f"](x, z)
    g, jacobian = nlp.derivatives["jac_g"](x, z)
    hessian = nlp.derivatives["hess_lag"](x, z, weight, multipliers)
    full = np.asarray(hessian.full())
    assert not np.any(np.tril(full, -1)), "Ipopt's interface takes the upper triangle only"
    return float(f), np.asarray(gradient).ravel(), np.asarray(g).ravel(), np.asarray(jacobian.full()), full


def weights(nlp):
    rng = np.random.default_rng(7)
    return 0.6, rng.standard_normal(nlp.n_constraints)


@every_nlp
def test_derivatives_against_casadi(name):
    nlp, z, x = EXAMPLES[name]
    weight, multipliers = weights(nlp)
    f, gradient, g, jacobian, hessian = own(nlp, x, z, weight, multipliers)
    sx, sz, sf, sg = (nlp.functions[key] for key in "xpfg")
    lagrangian = weight * sf + ca.dot(multipliers, sg)
    outputs = [sf, ca.gradient(sf, sx), sg, ca.jacobian(sg, sx), ca.hessian(lagrangian, sx)[0]]
    reference = ca.Function("ad", [sx, sz], outputs)
    expected = [np.asarray(ca.DM(part).full()) for part in reference(x, z)]
    assert f == pytest.approx(expected[0].item(), rel=1e-13)
    for mine, theirs in zip((gradient, g), (expected[1], expected[2]), strict=True):
        assert mine == pytest.approx(theirs.ravel(), rel=1e-11, abs=1e-11)
    assert np.max(np.abs(jacobian - expected[3])) < 1e-11 * (1 + np.max(np.abs(jacobian)))
    assert np.max(np.abs(hessian - np.triu(expected[4]))) < 1e-10 * (1 + np.max(np.abs(hessian)))


@every_nlp
def test_derivatives_against_central_differences(name):
    nlp, z, x = EXAMPLES[name]
    weight, multipliers = weights(nlp)
    _, gradient, _, jacobian, upper = own(nlp, x, z, weight, multipliers)
    hessian = upper + np.triu(upper, 1).T
    rng, step = np.random.default_rng(11), 1e-6
    fg = values(nlp)
    for _ in range(5):
        direction = rng.standard_normal(x.size)
        direction /= np.linalg.norm(direction)
        (f1, g1), (f0, g0) = fg(x + step * direction, z), fg(x - step * direction, z)
        slopes = [own(nlp, x + sign * step * direction, z, weight, multipliers) for sign in (1, -1)]
        gradients = [weight * slope[1] + slope[3].T @ multipliers for slope in slopes]
        assert float(f1 - f0) / (2 * step) == pytest.approx(gradient @ direction, rel=1e-6, abs=1e-6)
        rates = np.asarray(g1 - g0).ravel() / (2 * step)
        assert np.max(np.abs(rates - jacobian @ direction)) < 1e-6 * (1 + np.max(np.abs(rates)))
        curvature = (gradients[0] - gradients[1]) / (2 * step)
        assert np.max(np.abs(curvature - hessian @ direction)) < 1e-6 * (1 + np.max(np.abs(curvature)))


@every_nlp
def test_the_pattern_holds_in_any_point(name):
    """The sparsity handed to Ipopt must not depend on the point it was built at."""
    nlp, z, x = EXAMPLES[name]
    patterns = [nlp.derivatives["jac_g"](at, z)[1].sparsity() for at in (x, np.zeros_like(x) + 0.1)]
    assert patterns[0] == patterns[1]
    jacobian = ca.jacobian(nlp.functions["g"], nlp.functions["x"])
    missing = ca.DM(jacobian.sparsity(), 1.0) - ca.DM(patterns[0], 1.0)
    assert float(ca.mmax(missing)) <= 0, "CasADi sees a dependence that the assembled Jacobian leaves out"
