"""Pages of the public names: the sections of ``docs/reference.md``, each name with its whole docstring."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import nlsdesign

from . import markup

_ROW = re.compile(r"^\| `nls\.(\w+)` \|", re.M)


def pages(root: Path, folder: Path) -> dict[str, str]:
    """Return a page for each section of the reference, one for each room, and one that lists them."""
    made: dict[str, str] = {}
    listed = ""
    for title, names in sections(root):
        slug = re.sub(r"\W+", "_", title.lower()).strip("_")
        if title == "Rooms":
            made |= {f"reference/api/rooms/{name}.md": _room(name) for name in names}
            entries = "\n".join(f"rooms/{name}" for name in names)
            made["reference/api/rooms.md"] = _rooms(names) + f"```{{toctree}}\n:hidden:\n\n{entries}\n```\n"
        else:
            made[f"reference/api/{slug}.md"] = f"# {title}\n\n" + "".join(_documented(name) for name in names)
        rows = [
            [f'<a href="{_address(slug, n)}"><code>nls.{n}</code></a>', summary(getattr(nlsdesign, n))]
            for n in names
        ]
        listed += f"## {title}\n\n" + markup.table(
            ("name", "what it is"), rows, caption=f"{title}: public names"
        )
    order = [re.sub(r"\W+", "_", title.lower()).strip("_") for title, _ in sections(root)]
    front = (
        "# Python\n\n`import nlsdesign as nls` gives these names, with types; made from their "
        "docstrings. What is not here is in its "
        "[room](rooms.md).\n\n"
    )
    made["reference/api/index.md"] = (
        front + listed + "```{toctree}\n:hidden:\n\n" + "\n".join(order) + "\n```\n"
    )
    return made


def sections(root: Path) -> Iterator[tuple[str, list[str]]]:
    """Yield the sections of ``docs/reference.md`` with the public names in them.

    Parameters
    ----------
    root
        Of the project.
    """
    text = (root / "docs" / "reference.md").read_text(encoding="utf-8")
    for section in re.split(r"^## ", text, flags=re.M)[1:]:
        title, _, body = section.partition("\n")
        yield title.strip(), _ROW.findall(body)


def summary(value: object) -> str:
    """Return the first paragraph of a docstring as HTML.

    Parameters
    ----------
    value
        Anything with a docstring.
    """
    return markup.inline(" ".join((inspect.getdoc(value) or "").split("\n\n")[0].split()))


def _address(slug: str, name: str) -> str:
    return f"rooms/{name}.html" if slug == "rooms" else f"{slug}.html#nlsdesign.{name}"


def _documented(name: str, module: str = "nlsdesign") -> str:
    value = inspect.getattr_static(__import__(module, fromlist=["_"]), name, None)
    if value is None:
        value = getattr(nlsdesign, name)
    if inspect.isclass(value):
        directive = "autoexception" if issubclass(value, BaseException) else "autoclass"
        options = ":members:" if directive == "autoclass" else ""
    elif callable(value):
        directive, options = "autofunction", ""
    else:
        return f"<p><code>{name}</code></p>\n\n"
    return f"```{{eval-rst}}\n.. {directive}:: {module}.{name}\n   {options}\n```\n\n"


def _rooms(names: list[str]) -> str:
    rows = [
        [f'<a href="rooms/{name}.html"><code>nls.{name}</code></a>', summary(getattr(nlsdesign, name))]
        for name in names
    ]
    return "# Rooms\n\n" + markup.table(("room", "what lives there"), rows, caption="Rooms of the package")


def _room(name: str) -> str:
    room = getattr(nlsdesign, name)
    listed = getattr(room, "__all__", None) or [
        n
        for n, v in vars(room).items()
        if not n.startswith("_") and getattr(v, "__module__", "").startswith(room.__name__)
    ]
    rows = []
    for each in sorted(listed, key=str.lower):
        value = getattr(room, each)
        rows.append([f"<code>{each}{_signature(value)}</code>", summary(value) if _speaks(value) else ""])
    text = f"# nls.{name}\n\n" + markup.prose((inspect.getdoc(room) or "").strip())
    return text + markup.table(("name", "what it is"), rows, caption=f"Public names of nls.{name}")


def _speaks(value: object) -> bool:
    return inspect.isclass(value) or inspect.isroutine(value) or inspect.ismodule(value)


def _signature(value: object) -> str:
    if not inspect.isroutine(value):
        return ""
    names = [
        p.name for p in inspect.signature(value).parameters.values() if p.default is inspect.Parameter.empty
    ]
    return f"({', '.join(names)})"
