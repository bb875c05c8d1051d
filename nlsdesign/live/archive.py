"""A saved design as one file: an archive with its deck, its design file and where the search stood."""

from __future__ import annotations

import io
import zipfile

from ..export.files import BROKEN_ARCHIVE
from ..foundation.errors import DeckError, ValueRangeError
from .gallery import MOST_DECK_BYTES
from .saved import SavedDesign

MEMBERS = ("deck.toml", "design.toml", "live.toml")
"""Names in the archive; the commands take the first two as they are."""
_OLD = (1980, 1, 1, 0, 0, 0)
"""Date of the members, so that the same design gives the same bytes."""


def archived(design: SavedDesign) -> bytes:
    """Return a saved design as an archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in zip(MEMBERS, (design.deck, design.job, design.begin), strict=True):
            archive.writestr(zipfile.ZipInfo(name, _OLD), text)
    return buffer.getvalue()


def unarchived(content: bytes) -> SavedDesign:
    """Return the design of an archive; only its three members are read, and no more than they may hold."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            texts = [_member(archive, name) for name in MEMBERS]
    except UnicodeDecodeError:  # one of the errors of value that follow
        raise DeckError("saved design", "holds what is no text in UTF-8", next_step="save it again") from None
    except (KeyError, *BROKEN_ARCHIVE) as error:
        raise DeckError(
            "saved design", f"is no archive that the live page has written: {error}",
            next_step=f"take a file with {', '.join(MEMBERS)}, or open a deck",
        ) from None  # fmt: skip
    return SavedDesign(*texts)


def _member(archive: zipfile.ZipFile, name: str) -> str:
    # What the archive says of its sizes may be wrong, so no more is unpacked than is taken.
    with archive.open(name) as stream:
        content = stream.read(MOST_DECK_BYTES + 1)
    if len(content) > MOST_DECK_BYTES:
        raise ValueRangeError(
            name, f"is larger than {MOST_DECK_BYTES / 1e3:.0f} kB", next_step="give the file that was saved"
        )
    return content.decode("utf-8")
