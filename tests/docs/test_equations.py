"""Equations of the site."""

import runpy
from pathlib import Path

import pytest


@pytest.mark.slow  # the packages that build the site are installed for the slow tests
def test_punctuation_beside_an_equation_is_in_its_line():
    pytest.importorskip("sphinx")
    from docutils import nodes
    from docutils.utils import new_document

    document, paragraph = new_document("page"), nodes.paragraph()
    for text, equation in (("sticks (", "v = 0"), ("), as ", "a"), (" and ", "b")):
        paragraph += [nodes.Text(text), nodes.math("", equation)]
    document += paragraph
    runpy.run_path(str(Path(__file__).parents[2] / "docs" / "mathml.py"))["join_punctuation"](document)
    assert document.astext() == "sticks (v = 0), as a and b"
    assert [node.astext() for node in document.findall(nodes.inline)] == ["(v = 0),"]
    assert [node.astext() for node in document.findall(nodes.math)] == ["v = 0", "a", "b"]
