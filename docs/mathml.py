"""Sphinx extension: equations become MathML at build time, so that pages need neither scripts nor a network."""

import html
import re

from docutils import nodes
from sphinx.util import logging


def setup(app):
    """Add the renderer ``mathml`` of equations."""
    app.add_html_math_renderer("mathml", inline_renderers=(render_inline, None), block_renderers=(render_block, None))
    app.connect("doctree-resolved", lambda app, tree, name: join_punctuation(tree))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def join_punctuation(tree):
    """Join equations within lines to the punctuation beside them, which a browser would put on another line."""
    for node in list(tree.findall(nodes.math)):
        parent, place = node.parent, node.parent.index(node)
        before, after = parent[:place], parent[place + 1 :]
        opening = re.search(r"\(*$", str(before[-1]))[0] if before and isinstance(before[-1], nodes.Text) else ""
        closing = re.match(r"[.,;:)]*", str(after[0]))[0] if after and isinstance(after[0], nodes.Text) else ""
        if opening:
            before[-1] = nodes.Text(before[-1][: -len(opening)])
        if closing:
            after[0] = nodes.Text(after[0][len(closing) :])
        if opening or closing:
            parts = (nodes.Text(opening), node, nodes.Text(closing))
            joined = nodes.inline("", "", *parts, classes=["equation-with-punctuation"])
            parent.children = []
            parent.extend([*before, joined, *after])


def render_inline(translator, node):
    """Write an equation within a line."""
    translator.body.append(convert(node, displaystyle=False))
    raise nodes.SkipNode


def render_block(translator, node):
    """Write an equation between two paragraphs; its class is not that of the theme, which cuts off wide equations."""
    translator.body.append(f'<div class="equation">{convert(node, displaystyle=True)}</div>\n')
    raise nodes.SkipNode


def convert(node, *, displaystyle):
    """Return an equation as MathML; one with an unknown command causes a warning and remains LaTeX."""
    from math_core import LatexError, LatexToMathML

    latex = node.astext()
    try:
        return LatexToMathML().convert_with_local_state(latex, displaystyle=displaystyle)
    except LatexError as error:
        logging.getLogger(__name__).warning("invalid equation %r: %s", latex, error, location=node)
        return f"<code>{html.escape(latex)}</code>"
