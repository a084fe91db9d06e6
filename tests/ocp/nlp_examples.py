"""Transcriptions of the compass biped for tests."""

import numpy as np

from gaitopt import ContactSequence, compass_biped
from gaitopt.ocp.nlp.keys import table_name
from gaitopt.ocp.transcription.collocation import Lobatto
from gaitopt.ocp.transcription.shooting import RungeKutta
from gaitopt.ocp.transcription.transcription import Structure, transcribe

SCHEMES = (RungeKutta(), Lobatto())


def example_nlp(sequence, counts, objective, scheme=SCHEMES[0], **options):
    """Return the transcription of a contact sequence on a grid."""
    robot = compass_biped()
    options = {"powered": robot.actuators, **options}
    sequence = ContactSequence.parse(sequence)
    return transcribe(
        Structure(robot=robot, sequence=sequence, objective=objective, scheme=scheme, counts=counts, **options)
    )


def unknowns(gait, transcription):
    """Return the decision vector of a solved gait in the order of a transcription."""
    x = np.empty(transcription.variables.size)
    for key, places in transcription.variables.tables.items():
        x[places] = gait.solution.unknowns[table_name(key)].values
    return x
