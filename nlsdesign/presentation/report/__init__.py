"""Reports: sections composed into one self-contained file of HTML."""

from .command_pages import SIZES as SIZES
from .command_pages import (
    write_analysis_report,
    write_diagnosis_report,
    write_fit_report,
    write_observer_report,
    write_simulation_report,
)
from .design_sections import CamSection, design_sections, tolerance_sections, write_design_report
from .diagnosis_sections import verdict_sections
from .sections import (
    Chapter,
    FigureSection,
    FileSection,
    FoldedSection,
    KeyNumber,
    NumbersSection,
    Section,
    TableSection,
    TextSection,
    write_report,
)
from .side_by_side import ComparedResult, differing_numbers, key_figures, write_comparison
from .tables import (
    OUTCOMES,
    CalculationSection,
    CalculationStep,
    EquationsSection,
    PublishedNumber,
    comparison_table,
    numbers_table,
)

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
    "FoldedSection",
    "KeyNumber",
    "NumbersSection",
    "PublishedNumber",
    "Section",
    "TableSection",
    "TextSection",
    "comparison_table",
    "design_sections",
    "differing_numbers",
    "key_figures",
    "numbers_table",
    "tolerance_sections",
    "verdict_sections",
    "write_analysis_report",
    "write_comparison",
    "write_design_report",
    "write_diagnosis_report",
    "write_fit_report",
    "write_observer_report",
    "write_report",
    "write_simulation_report",
]
