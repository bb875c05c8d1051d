"""The live design: one designer's state, edits, answers within a frame, and the page that shows them.

May be imported by ``cli``. The session (:class:`LiveDesign` and what it uses) is plain Python; server and
page stand in modules of their own. Never computes what a room below could compute.
"""

from .answers import AngleAnswer, DesignView, LiveAnswer, Mechanism, to_json
from .edits import (
    AddPoint,
    ChangeLimit,
    ChooseDeck,
    ChooseMaterial,
    DropLimit,
    Edit,
    FreeNumber,
    HoldNumber,
    MovePoint,
    RemovePoint,
    SetNumber,
    edit_from,
)
from .gallery import GalleryCard, gallery, gallery_question, question_of, question_of_deck
from .live_design import LiveDesign, Snapshot
from .question import LiveQuestion, TargetPoint

__all__ = [
    "AddPoint", "AngleAnswer", "ChangeLimit", "ChooseDeck", "ChooseMaterial", "DesignView", "DropLimit",
    "Edit", "FreeNumber", "GalleryCard", "HoldNumber", "LiveAnswer", "LiveDesign", "LiveQuestion",
    "Mechanism", "MovePoint", "RemovePoint", "SetNumber", "Snapshot", "TargetPoint", "edit_from", "gallery",
    "gallery_question", "question_of", "question_of_deck", "to_json",
]  # fmt: skip
