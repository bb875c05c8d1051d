"""The live design: one designer's state, edits, answers within a frame, and the page that shows them.

May be imported by ``cli``. The session (:class:`LiveDesign` and what it uses) is plain Python; server and
page stand in modules of their own. Never computes what a room below could compute.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

# The server is a room mate of the session but must answer before any numerical library is loaded, so what
# the session brings is imported when it is first asked for.
if TYPE_CHECKING:
    from ..design.parametric.cam_question import TargetPoint
    from .answers import AngleAnswer, DesignView, LiveAnswer, Mechanism, to_json
    from .background import WorkState
    from .edits import (
        AddPoint,
        ChangeLimit,
        ChooseDeck,
        ChooseMaterial,
        DropLimit,
        FreeNumber,
        HoldNumber,
        LiveEdit,
        MovePoint,
        RemovePoint,
        ScaleTarget,
        SetNumber,
        edit_from,
    )
    from .exports import EXPORTS, ExportDesign, ExportedDesign
    from .full_design import FullDesign
    from .gallery import GalleryCard, gallery_cards, gallery_question, question_of, question_of_deck
    from .live_design import LiveDesign
    from .live_snapshots import Snapshot
    from .question import LiveQuestion
    from .saved import SavedDesign, reopened
    from .work import (
        CloudAnswer,
        DiagnoseRecords,
        DiagnosisAnswer,
        LiveTask,
        SettleDesign,
        ToleranceCloud,
        TorqueLoop,
    )

__all__ = [
    "EXPORTS",
    "AddPoint",
    "AngleAnswer",
    "ChangeLimit",
    "ChooseDeck",
    "ChooseMaterial",
    "CloudAnswer",
    "DesignView",
    "DiagnoseRecords",
    "DiagnosisAnswer",
    "DropLimit",
    "ExportDesign",
    "ExportedDesign",
    "FreeNumber",
    "FullDesign",
    "GalleryCard",
    "HoldNumber",
    "LiveAnswer",
    "LiveDesign",
    "LiveEdit",
    "LiveQuestion",
    "LiveTask",
    "Mechanism",
    "MovePoint",
    "RemovePoint",
    "SavedDesign",
    "ScaleTarget",
    "SetNumber",
    "SettleDesign",
    "Snapshot",
    "TargetPoint",
    "ToleranceCloud",
    "TorqueLoop",
    "WorkState",
    "edit_from",
    "gallery_cards",
    "gallery_question",
    "question_of",
    "question_of_deck",
    "reopened",
    "to_json",
]

_PLACES = (
    "answers",
    "background",
    "edits",
    "exports",
    "full_design",
    "gallery",
    "live_design",
    "live_snapshots",
    "question",
    "saved",
    "work",
)


def __getattr__(name: str) -> object:
    """Return a public name from the module in which it lives."""
    if name in __all__:
        for place in _PLACES:
            module = importlib.import_module(f".{place}", __name__)
            if name in vars(module):
                return vars(module)[name]
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
