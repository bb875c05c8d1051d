"""Reports: sections composed into one self-contained file of HTML."""

from .calculation import OUTCOMES, CalculationSection, CalculationStep
from .cam_section import CamSection
from .command_pages import write_analysis_report, write_fit_report, write_observer_report
from .design_sections import design_sections, tolerance_sections, write_design_report
from .diagnosis import verdict_sections
from .equations_section import EquationsSection
from .page import report_text, write_report
from .point_table import PointTableSection
from .regeneration_sections import regeneration_sections
from .sections import (
    Chapter,
    FigureSection,
    FileSection,
    KeyNumber,
    NumbersSection,
    Section,
    TableSection,
    TextSection,
)
from .side_by_side import ComparedResult, differing_numbers, key_figures, torque_at_rest, write_comparison
from .tables import PublishedNumber, comparison_table, numbers_table, range_table
from .verdict_section import VerdictSection

__all__ = [
    "OUTCOMES",
    "CalculationSection",
    "CalculationStep",
    "CamSection",
    "Chapter",
    "ComparedResult",
    "EquationsSection",
    "FigureSection",
    "FileSection",
    "KeyNumber",
    "NumbersSection",
    "PointTableSection",
    "PublishedNumber",
    "Section",
    "TableSection",
    "TextSection",
    "VerdictSection",
    "comparison_table",
    "design_sections",
    "differing_numbers",
    "key_figures",
    "numbers_table",
    "range_table",
    "regeneration_sections",
    "report_text",
    "tolerance_sections",
    "torque_at_rest",
    "verdict_sections",
    "write_analysis_report",
    "write_comparison",
    "write_design_report",
    "write_fit_report",
    "write_observer_report",
    "write_report",
]
