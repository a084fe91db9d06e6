"""Sphinx extension: equations become MathML at build time, so that pages need neither scripts nor a network."""

import html

from docutils import nodes
from sphinx.util import logging


def setup(app):
    """Add the renderer ``mathml`` of equations."""
    app.add_html_math_renderer("mathml", inline_renderers=(render_inline, None), block_renderers=(render_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


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
