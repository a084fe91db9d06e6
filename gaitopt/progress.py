"""Progress of long computations, as data passed to an observer.

The library never prints.  Long computations accept an ``observer``, a callable that does nothing by default.  An
optimisation calls it with one :class:`Iteration` at a time, and for an open contact sequence with one
:class:`HomotopyIteration` after each relaxed problem; a search for gains with one :class:`TuningStep` per evaluation,
and its verification with one :class:`VerificationStep` per walk; a study with the number of finished tasks and of all
tasks.  :class:`ProgressLine` is an observer for notebooks and terminals.
"""

import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any, Self, TextIO

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError

__all__ = ["HomotopyIteration", "Iteration", "ProgressLine", "TuningStep", "VerificationStep"]

UPDATE_INTERVAL = 0.2
"""Minimum time between two updates of a progress line [s]."""


@dataclass(frozen=True)
class Iteration:
    """One iteration of an optimisation.

    Attributes
    ----------
    number : int
        Iteration count, from 0.
    objective : float
        Objective in its unit (dimensionless for a cost of transport).
    infeasibility : float
        Largest violation of a scaled constraint.
    intervals : int
        Number of intervals of the grid if the solve continues from another solution of the gait, as on a refined grid;
        otherwise 0.

    Examples
    --------
    >>> Iteration(3, 0.016, 1e-9).number
    3
    >>> Iteration(3, 0.016, 1e-9, intervals=32).grid
    ' on 32 intervals'
    """

    number: int
    objective: float
    infeasibility: float
    intervals: int = 0

    @property
    def grid(self) -> str:
        """The intervals as the continuation of a text; empty at a first solve."""
        return f" on {self.intervals} intervals" if self.intervals else ""


@dataclass(frozen=True)
class HomotopyIteration:
    """One relaxed problem of a homotopy.

    Attributes
    ----------
    number : int
        From 1.
    relaxation : float
        Parameter t of the relaxation.
    objective : float
        Objective in its unit, without penalty terms.
    complementarity : float
        Residual of the unrelaxed complementarity pairs, see :class:`gaitopt.motion.Proposal`.
    iterations : int
    status : str
        Status of the relaxed solve.

    Examples
    --------
    >>> HomotopyIteration(1, 0.1, 0.016, 2e-3, 25, "solved").status
    'solved'
    """

    number: int
    relaxation: float
    objective: float
    complementarity: float
    iterations: int
    status: str


@dataclass(frozen=True)
class TuningStep:
    """One evaluation of a search for gains.

    Attributes
    ----------
    number : int
        From 1.
    objective : float
        Objective of the evaluated gains.
    best : float
        Lowest objective so far.
    limit : int
        Maximum number of evaluations of the search; 0 if unknown.

    Examples
    --------
    >>> TuningStep(3, 0.71, 0.64).best
    0.64
    """

    number: int
    objective: float
    best: float
    limit: int = 0


@dataclass(frozen=True)
class VerificationStep:
    """One walk of a verification by walks from perturbed starts.

    Attributes
    ----------
    radius : float [rad/s]
        Radius of the ball of pushes that contains the start.
    walks, starts : int
        Finished walks in this ball, and number of starts; the first walk that does not return ends the ball.

    Examples
    --------
    >>> VerificationStep(0.125, 3, 200).walks
    3
    """

    radius: float
    walks: int
    starts: int


Observer = Callable[[Iteration], None]
TuningObserver = Callable[[TuningStep | VerificationStep], None]
SolveObserver = Callable[[Iteration | HomotopyIteration], None]


def silent(step: Iteration | HomotopyIteration | TuningStep | VerificationStep) -> None:
    """Ignore all progress; the default observer."""


class NotebookBar:
    """A bar in the output of a notebook cell, which is updated in place."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, text: str, share: float | None) -> None:
        """Show a line of text, and a bar if the finished share is known."""
        import html  # which commands and studies do not need

        display: Any = import_module("IPython.display")
        bar = "" if share is None else f'<progress value="{share:.4f}" max="1"></progress> '
        shown = display.HTML(f"<div>{bar}{html.escape(text)}</div>")
        if self._handle is None:
            self._handle = display.display(shown, display_id=True)
        else:
            self._handle.update(shown)


def _in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    if "IPython" not in sys.modules:
        return False
    shell = sys.modules["IPython"].get_ipython()
    return shell is not None and hasattr(shell, "kernel")


@check_arguments
class ProgressLine:
    r"""An observer that updates one line of text in a terminal, or a bar with this line in a notebook.

    Every function with an ``observer`` accepts it.  In a ``with`` statement the line shows the last state at the end;
    without one, updates may be up to 0.2 s old.

    Parameters
    ----------
    label : str
        Beginning of the line.
    stream : text file, optional
        Standard output by default.

    Raises
    ------
    InputError
        If the label is not a string, or the stream has no method ``write``.

    Examples
    --------
    >>> import io
    >>> text = io.StringIO()
    >>> with ProgressLine("sweep", stream=text) as observer:
    ...     observer(1, 2)
    ...     observer(2, 2)
    >>> text.getvalue().split("\r")[-1][:10]
    'sweep: 2/2'
    """

    def __init__(self, label: str = "progress", *, stream: TextIO | None = None) -> None:
        if not isinstance(label, str):
            raise InputError(f"label must be a string such as 'sweep', got {label!r}.")
        if stream is not None and not callable(getattr(stream, "write", None)):
            raise InputError(f"stream must be a text file such as sys.stderr, got {stream!r}.")
        self._label, self._stream = label, stream
        self._start, self._updated, self._length, self._text = time.monotonic(), 0.0, 0, ""
        self._share: float | None = None
        self._bar = NotebookBar() if stream is None and _in_notebook() else None

    def __call__(
        self, step: Iteration | HomotopyIteration | TuningStep | VerificationStep | int, total: int | None = None
    ) -> None:
        """Receive a step of an optimisation or a tuning, or the number of finished tasks and of all tasks."""
        self._share = step / total if isinstance(step, int) and total else None
        self._text = f"{self._label}: {_describe_step(step, total)}, {time.monotonic() - self._start:.0f} s"
        if time.monotonic() - self._updated >= UPDATE_INTERVAL:
            self._write()

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        return self

    def __exit__(self, *exception: object) -> None:
        self._write(end="\n")

    def _write(self, end: str = "") -> None:
        if self._bar is not None:
            self._bar.show(self._text, self._share)
            self._updated = time.monotonic()
            return
        stream = self._stream or sys.stdout
        stream.write(f"\r{self._text.ljust(self._length)}{end}")
        stream.flush()
        self._updated, self._length = time.monotonic(), len(self._text)


def _describe_step(step: Iteration | HomotopyIteration | TuningStep | VerificationStep | int, total: int | None) -> str:
    match step:
        case Iteration():
            numbers = f"objective {step.objective:.6g}, infeasibility {step.infeasibility:.1e}"
            return f"iteration {step.number}{step.grid}, {numbers}"
        case HomotopyIteration():
            return f"relaxation {step.relaxation:.0e}, objective {step.objective:.6g}, {step.status}"
        case TuningStep():
            return f"evaluation {step.number}, objective {step.objective:.4g}, best {step.best:.4g}"
        case VerificationStep():
            return f"verification, walk {step.walks} of {step.starts} within {step.radius:.3g} rad/s"
    return f"{step}/{total}"
