"""All expressions are built while the lock of expressions is held, by one thread at a time."""

import subprocess
import sys

SCRIPT = """
import sys, types
import casadi as ca
from casadi import _casadi
import gaitopt.ocp.transcription.transcription  # a module has the lock of its import
from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, simulate, solve, verify
from gaitopt.locks import ONE_AT_A_TIME

calls, unlocked = 0, set()


def watch(name, function):
    def call(*arguments):
        global calls
        result = function(*arguments)
        if any(isinstance(value, (ca.SX, ca.MX)) for value in (*arguments, result)):
            calls += 1
            if not ONE_AT_A_TIME._lock._is_owned():
                unlocked.add((name, sys._getframe(2).f_code.co_qualname))
        return result

    return call


for name in dir(_casadi):
    function = getattr(_casadi, name)
    if isinstance(function, types.BuiltinFunctionType) and not name.startswith(("_", "delete")) and "swig" not in name:
        setattr(_casadi, name, watch(name, function))
problem = GaitProblem(
    robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.633, step_length=0.4713,
    limits=Limits(torque=6), objective="torque_squared", transcription=MultipleShooting(intervals=10),
)
gait = verify(solve(problem))
first = gait.motion.segments[0]
simulate(compass_biped(), first.q[:, 0], first.v[:, 0], {"friction": 0.3})
print(calls > 5000, sorted(unlocked))
"""


def test_expressions_are_built_by_one_thread_at_a_time():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout == "True []\n"
