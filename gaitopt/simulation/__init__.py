"""Event-driven stick-slip simulation and the verification of gaits by replay.

:func:`simulate` integrates a robot through touchdowns, slip onsets and reversals with an exchangeable engine;
:func:`verify` replays a solved gait and compares it with the plan.
"""

from gaitopt.lazy_exports import export_lazily

export_lazily(__name__)
