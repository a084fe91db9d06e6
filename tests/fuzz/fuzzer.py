"""Calls of public names in which one or two arguments are odd, and what becomes of them.

The names and their arguments come from the package itself: a new public name is called without any change here.
"""

import contextlib
import importlib
import inspect
import io
import pkgutil
import signal
import time
import warnings
from enum import Enum
from pathlib import Path

import numpy as np

import gaitopt
from gaitopt.errors import GaitoptError
from tests.fuzz.good_values import good_values, special_values
from tests.fuzz.odd_values import ODD

TIME_LIMIT, PATIENCE = 10.0, 90.0
"""Longest processor time and longest duration of a call [s]; other programs may use the processor, too."""

RESULTS = (
    *("Gait", "Motion", "Robot", "PlanarRobot", "Cycle", "PlanarCycle", "Solution", "Table", "Segment", "Jump"),
    *("BranchDiagram", "GaitBranch", "SpecialCurve", "SpecialPoint", "PlanarLaw", "Law", "Impact", "ImpactOutcome"),
    *("ModeChoice", "PlanarCheck", "RobotCheck", "Transition", "Certificate", "Conflict", "Ledger", "NearConstraint"),
    *("PlanarEvent", "PlanarGait", "PlanarMotion", "PlanarSegment", "PlanarVerification", "Proposal", "Sensitivity"),
    *("SolverReport", "Verification", "Violation", "Event", "PlanarRollout", "Rollout", "CriticalFriction"),
    *("GainSensitivity", "Recovery", "Comparison", "Imitation", "RankedGait", "Ranking", "RobustnessMargins"),
    *("WalkTest", "Trial", "Tuning", "ScriptRecord", "ImportedRobot", "ContactModel", "PlanarInstant", "Determinacy"),
)
"""Records that functions return: nobody makes them from input."""


def public_callables():
    """Return the public functions and classes by name, each once."""
    wings = ["gaitopt", *(f"gaitopt.{part.name}" for part in pkgutil.iter_modules(gaitopt.__path__) if part.ispkg)]
    found = {}
    for wing in wings:
        module = importlib.import_module(wing)
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            kind = isinstance(value, type)
            skipped = kind and (issubclass(value, BaseException | Enum) or inspect.isabstract(value) or name in RESULTS)
            protocol = getattr(value, "_is_protocol", False)
            if callable(value) and not skipped and not protocol and value not in found.values():
                found[f"{wing}.{name}"] = value
    return found


COSTLY, SELDOM = ("plot_gait", "plot_motion", "plot_comparison", "animate", "assess_robustness", "solve", "search"), 8
"""Functions that take seconds if they accept their arguments, and in how many rounds they are called once."""


class Hang(BaseException):
    """A call that took too long."""


def _stop(*_):
    raise Hang


class Fuzzer:
    """Draws calls and makes them.

    Parameters
    ----------
    root : Path
        Folder of the repository.
    """

    def __init__(self, root):
        self.root, self.callables = Path(root), public_callables()
        self.good, self.special = good_values(self.root), special_values(self.root)

    def draw(self, number):
        """Return the name and the arguments of a call: the names of odd values, True for a good one."""
        rng = np.random.default_rng([20261122, number])
        names = list(self.callables)
        name, round_ = names[number % len(names)], number // len(names)
        if round_ % SELDOM and name.rpartition(".")[2] in COSTLY:
            name = names[int(rng.integers(len(names)))]
        parameters = inspect.signature(self.callables[name]).parameters.values()
        named = [p for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
        odd = list(ODD)
        chosen = rng.choice(len(named), min(len(named), 1 + int(rng.random() < 0.25)), replace=False) if named else []
        arguments = {}
        for place, parameter in enumerate(named):
            known = self._good(name, parameter.name) is not None
            if place in chosen or (parameter.default is parameter.empty and not known):
                arguments[parameter.name] = odd[int(rng.integers(len(odd)))]
            elif known:
                arguments[parameter.name] = True
        return name, arguments

    def _good(self, name, parameter):
        special = self.special.get(name.rpartition(".")[2], {})
        return special[parameter] if parameter in special else self.good.get(parameter)

    def call(self, name, arguments, folder):
        """Return what a call ended in: accepted, refused, raw and the error, or hang."""
        values = {
            key: self._good(name, key) if odd is True else ODD[odd]()
            for key, odd in arguments.items()
            if odd is not True or self._good(name, key) is not None
        }
        if arguments.get("path") is True or ("path" in values and "path" not in arguments):
            values["path"] = folder / "out.nc"
        former = {number: signal.signal(number, _stop) for number in (signal.SIGALRM, signal.SIGPROF)}
        signal.setitimer(signal.ITIMER_REAL, PATIENCE)
        signal.setitimer(signal.ITIMER_PROF, TIME_LIMIT)
        try:
            with (
                warnings.catch_warnings(),
                contextlib.redirect_stdout(io.StringIO()),
                contextlib.redirect_stderr(io.StringIO()),
                contextlib.chdir(folder),
                np.errstate(all="ignore"),
            ):
                warnings.simplefilter("ignore")
                result = self.callables[name](**values)
                if inspect.isgenerator(result):
                    next(result, None)
        except GaitoptError:
            return "refused"
        except Hang:
            return "hang"
        except Exception as error:
            return f"raw {type(error).__name__}: {error!s:.100}"
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.setitimer(signal.ITIMER_PROF, 0)
            for number, handler in former.items():
                signal.signal(number, handler)
        return "accepted"


def describe(name, arguments):
    """Return a call as text."""
    return f"{name}({', '.join(f'{key}={odd}' for key, odd in arguments.items() if odd is not True)})"


def fuzz(count, root, folder, first=0):
    """Yield the text, the outcome and the duration of each of a number of calls."""
    fuzzer = Fuzzer(root)
    for number in range(first, first + count):
        name, arguments = fuzzer.draw(number)
        began = time.perf_counter()
        outcome = fuzzer.call(name, arguments, folder)
        yield describe(name, arguments), outcome, time.perf_counter() - began
