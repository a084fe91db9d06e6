"""Transcription methods by name."""

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.shooting import MultipleShooting

TRANSCRIPTIONS: dict[str, type[Collocation | MultipleShooting]] = {
    "collocation": Collocation,
    "multiple_shooting": MultipleShooting,
}


@check_arguments
def transcription_named(name: str) -> type[Collocation | MultipleShooting]:
    """Return the class of a transcription method from its name, for scripts with a parameter ``transcription``.

    Parameters
    ----------
    name : str
        ``"collocation"`` or ``"multiple_shooting"``.

    Raises
    ------
    InputError
        If the name is unknown; the message names the nearest.

    Examples
    --------
    >>> transcription_named("multiple_shooting")(intervals=20).name
    'multiple shooting, 1 substep'
    """
    if name not in TRANSCRIPTIONS:
        raise InputError(f"There is no transcription {name!r}. {suggest(str(name), TRANSCRIPTIONS)}")
    return TRANSCRIPTIONS[name]
