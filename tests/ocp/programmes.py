"""Transcriptions of the compass biped for tests."""

import numpy as np

from gaitopt import Word, compass_biped
from gaitopt.ocp.collocation import Lobatto
from gaitopt.ocp.shooting import RungeKutta
from gaitopt.ocp.transcription import Structure, transcribe

SCHEMES = (RungeKutta(), Lobatto())


def programme(word, counts, objective, scheme=SCHEMES[0], **options):
    """Return the transcription of a word on a grid."""
    robot = compass_biped()
    options = {"powered": robot.actuators, **options}
    word = Word.parse(word)
    return transcribe(Structure(robot=robot, word=word, objective=objective, scheme=scheme, counts=counts, **options))


def unknowns(gait, transcription):
    """Return the decision vector of a solved gait in the order of a transcription."""
    x = np.empty(transcription.variables.size)
    for name, places in transcription.variables.tables.items():
        x[places] = gait.solution.unknowns[name].values
    return x
