"""Announcement of the cost of tuning: the evaluations of the search, and the walks of the verification."""

import math
import time
from typing import TYPE_CHECKING

from gaitopt.cli.law_option import is_file_of_gains
from gaitopt.cli.output import err
from gaitopt.motion.printable import format_count
from gaitopt.progress import TuningStep, VerificationStep

if TYPE_CHECKING:
    from gaitopt.stability.recovery import PushTest
    from gaitopt.tuning.gain_search import GainSearchOptions

LONG = 120.0
"""Time from which a duration is stated in minutes [s]."""

SLOW = 2.0
"""Time of an evaluation from which that of the assessment of the best gains is announced [s]."""

SLOW_SEARCH = 60.0
"""Duration of a search from which it is announced [s]."""

ENOUGH, MOST_TIMED = 0.5, 20
"""Time [s] and number of walks after which the time of a walk is known."""


class TuningAnnouncement:
    """Prints on standard error what a tuning computes and, once they are timed, how long its slow parts take.

    Parameters
    ----------
    search : GainSearchOptions
    test : PushTest
    hidden : bool
        Whether nothing is printed.

    Attributes
    ----------
    advice : str or None
        How a slow search becomes faster.
    trial_walks : int
        Maximum number of walks under other laws after the verification.
    """

    def __init__(self, search: "GainSearchOptions", test: "PushTest", *, hidden: bool) -> None:
        self.advice: str | None = None
        self.trial_walks = 0
        self._evaluation = math.nan
        self._search, self._test, self._hidden = search, test, hidden
        self._walks, self._first, self._announced, self._first_evaluated = 0, 0.0, False, 0.0

    def begin(self, law: str = "") -> None:
        """Print the maximum number of evaluations of the search, and of walks of verification and trials.

        Parameters
        ----------
        law : str
            Option of the command; a search continues from the gains of a file.
        """
        self._print(describe_search(self._search))
        if is_file_of_gains(law):
            from gaitopt.tuning.tuning_file import load_tuning

            count = format_count(len(load_tuning(law).trials), "evaluation")
            self._print(
                f"search: the initial gains are those of the file; its {count} are not repeated, and the record of "
                "this search does not contain them"
            )
        self._print(describe_verification(self._test))
        if self.trial_walks:
            self._print(
                f"trials of other laws: at most {self.trial_walks} walks, only if the gait recovers from negligible "
                "pushes only (--no-trials omits them)"
            )

    def time_step(self, step: TuningStep | VerificationStep) -> TuningStep | VerificationStep:
        """Return a step; print the expected duration of a slow search, or of the verification, once it is known.

        The second evaluation determines the duration of the search, since the first one includes the compilation of
        the equations.  The time of the first walk is not known: before it, the law of the best gains is assessed.  The
        times of walks differ by their numbers of steps, so that short ones are averaged.
        """
        if isinstance(step, VerificationStep):
            self._walks += 1
            if self._walks == 1:
                self._first = time.perf_counter()
            elif not self._announced:
                elapsed, count = time.perf_counter() - self._first, self._walks - 1
                if elapsed >= ENOUGH or self._walks >= min(MOST_TIMED, self._test.starts):
                    self._announced = True
                    self._print(describe_duration(elapsed / count, self._test.most_walks, self.trial_walks))
        elif step.number == 1:
            self._first_evaluated = time.perf_counter()
        elif step.number == 2:
            self._evaluation = time.perf_counter() - self._first_evaluated
            if self._evaluation * self._search.evaluations_in_total >= SLOW_SEARCH:
                self._print(describe_search_duration(self._evaluation, self._search.evaluations_in_total))
                if self.advice:
                    self._print(self.advice)
        return step

    def announce_end(self) -> None:
        """Print after a Ctrl-C what is still computed, if it takes long."""
        if self._walks == 0 and not self._evaluation < SLOW:
            longest = "" if math.isnan(self._evaluation) else f", which takes about {_show_duration(self._evaluation)}"
            ended = "the search ends" if self._first_evaluated else "the first evaluation is completed"
            self._print(
                f"Interrupted: {ended}, and the law of the best gains is assessed{longest}; a second Ctrl-C ends the "
                "command without a result."
            )

    def _print(self, text: str) -> None:
        if not self._hidden:
            err.print(text, soft_wrap=True)


def describe_search(search: "GainSearchOptions") -> str:
    """Return the maximum number of evaluations of a search and its parts.

    Examples
    --------
    >>> from gaitopt import GainSearchOptions
    >>> describe_search(GainSearchOptions(evaluations=20))
    'search: at most 49 evaluations: the initial gains, 8 random sets of gains (--samples) and 2 simplex searches of \
at most 20 evaluations each (--evaluations)'
    """
    parts = ["the initial gains"]
    if search.samples:
        parts.append(f"{search.samples} random set{'s' * (search.samples > 1)} of gains (--samples)")
    count, each = search.simplex_searches, f"at most {search.evaluations} evaluation{'s' * (search.evaluations > 1)}"
    simplex = f"one simplex search of {each}" if count == 1 else f"{count} simplex searches of {each} each"
    return (
        f"search: at most {search.evaluations_in_total} evaluations: {', '.join(parts)} and {simplex} (--evaluations)"
    )


def describe_search_duration(seconds: float, evaluations: int) -> str:
    """Return the expected duration of a search.

    Parameters
    ----------
    seconds : float
        Duration of the second evaluation.
    evaluations : int
        Maximum number of evaluations.

    Examples
    --------
    >>> describe_search_duration(20, 129)
    'search: the second evaluation took 20 s, so that all evaluations take about 43 min; smaller values of \
--samples and --evaluations shorten the search, and Ctrl-C ends it and keeps the best gains'
    """
    return (
        f"search: the second evaluation took {seconds:.2g} s, so that all evaluations take about "
        f"{_show_duration(seconds * evaluations)}; smaller values of --samples and --evaluations shorten the search, "
        "and Ctrl-C ends it and keeps the best gains"
    )


def describe_verification(test: "PushTest") -> str:
    """Return how many walks a verification takes.

    Examples
    --------
    >>> from gaitopt import PushTest
    >>> describe_verification(PushTest())
    'verification: at most about 2000 walks of at most 30 steps each, from 200 random pushes (--starts) in each of \
about 10 balls'
    """
    pushes = f"{test.starts} random push{'es' * (test.starts > 1)} (--starts)"
    return (
        f"verification: at most about {test.most_walks} walks of at most {format_count(test.steps, 'step')} each, from "
        f"{pushes} in each of about {test.most_walks // test.starts} balls"
    )


def describe_duration(seconds: float, walks: int, trial_walks: int = 0) -> str:
    """Return the expected duration of a verification.

    Parameters
    ----------
    seconds : float
        Mean duration of the first walks.
    walks : int
        Approximate maximum number of walks.
    trial_walks : int
        Maximum number of further walks under other laws.

    Examples
    --------
    >>> describe_duration(0.31, 2000)
    'verification: a walk from a small push takes 0.31 s, so that all walks take about 10 min, or longer if \
larger pushes take more steps; Ctrl-C ends the verification and keeps the gains'
    """
    trials = f", and trials of other laws up to {_show_duration(seconds * trial_walks)} more" if trial_walks else ""
    return (
        f"verification: a walk from a small push takes {seconds:.2g} s, so that all walks take about "
        f"{_show_duration(seconds * walks)}{trials}, or longer if larger pushes take more steps; Ctrl-C ends the "
        "verification and keeps the gains"
    )


def _show_duration(seconds: float) -> str:
    """Return a duration as a text in seconds or minutes."""
    return f"{seconds / 60:.0f} min" if seconds >= LONG else f"{max(seconds, 1.0):.0f} s"
