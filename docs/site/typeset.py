"""Equations as MathML, which browsers typeset without a script, and links by short names: an extension."""

from __future__ import annotations

from html import escape
from typing import Any

from docutils import nodes, utils
from docutils.utils import math
from docutils.utils.math import latex2mathml
from sphinx.util import logging

from nlsdesign.components.assembly.deck_reader import component_classes

from . import formula
from .rooms import room_of

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


def _formula(
    name: str, rawtext: str, text: str, lineno: int, inliner: Any, options: Any = None, content: Any = ()
) -> tuple[list[nodes.Node], list[nodes.system_message]]:
    """Return a formula in the notation of docstrings as MathML."""
    return [nodes.raw(rawtext, formula.mathml(utils.unescape(text)), format="html")], []


def mark_formulas(lines: list[str]) -> None:
    """Put the role ``formula`` around the formulas of a docstring, in place.

    Parameters
    ----------
    lines
        Of the docstring; examples and code stay as they are.
    """
    for number, line in enumerate(lines):
        if ">>>" in line or "`" in line:
            continue
        for found in formula.formulas(line):
            lines[number] = lines[number].replace(found, f":formula:`{found}`", 1)


def _docstring(app: Any, what: str, name: str, documented: object, options: Any, lines: list[str]) -> None:
    mark_formulas(lines)


def _resolved(app: Any, env: Any, node: Any, shown: nodes.Node) -> nodes.Node | None:
    """Return a link to a part or a public name that a docstring names without its whole path."""
    if node.get("refdomain") != "py":
        return None
    name = node["reftarget"].rpartition(".")[2]
    known = component_classes()
    if name in known:
        page = f"reference/parts/{room_of(known[name])}"
        address = f"{app.builder.get_relative_uri(node['refdoc'], page)}#part-{name}"
        return nodes.reference("", "", shown, internal=True, refuri=address)
    place = env.get_domain("py").objects.get(f"nlsdesign.{name}")
    if place is None:
        return None
    address = f"{app.builder.get_relative_uri(node['refdoc'], place.docname)}#{place.node_id}"
    return nodes.reference("", "", shown, internal=True, refuri=address)


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer.

    Parameters
    ----------
    app
        Of Sphinx.
    """
    app.add_role("formula", _formula)
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("missing-reference", _resolved)
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
