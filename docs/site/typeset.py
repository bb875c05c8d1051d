"""Equations as MathML, which browsers typeset without any script: an extension of Sphinx."""

from __future__ import annotations

from html import escape
from typing import Any

from docutils import nodes
from docutils.utils import math
from docutils.utils.math import latex2mathml
from sphinx.util import logging

_LOG = logging.getLogger(__name__)


def mathml(latex: str, *, block: bool) -> str:
    """Return LaTeX as a ``math`` element.

    Parameters
    ----------
    latex
        Without dollar signs.
    block
        Whether it stands on a line of its own.
    """
    text = " ".join(latex.split())
    if block and (r"\\" in text or "&" in text) and r"\begin" not in text:
        text = rf"\begin{{aligned}}{text}\end{{aligned}}"
    return latex2mathml.tex2mathml(text, as_block=block)


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_typeset(node, block=False))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="equation">{_typeset(node, block=True)}</div>\n')
    raise nodes.SkipNode


def _typeset(node: nodes.Element, *, block: bool) -> str:
    """Return MathML; what cannot be set is a warning with its place, and so ends the build."""
    try:
        return mathml(node.astext(), block=block)
    except math.MathError as error:
        _LOG.warning("equation cannot be set: %s", error, location=node)
        return f"<code>{escape(node.astext())}</code>"


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer.

    Parameters
    ----------
    app
        Of Sphinx.
    """
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
