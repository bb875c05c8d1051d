"""Reports: sections composed into one self-contained file of HTML."""

from .command_pages import SIZES as SIZES
from .command_pages import (
    write_analysis_report as write_analysis_report,
)
from .command_pages import (
    write_diagnosis_report as write_diagnosis_report,
)
from .command_pages import (
    write_fit_report as write_fit_report,
)
from .command_pages import (
    write_observer_report as write_observer_report,
)
from .command_pages import (
    write_simulation_report as write_simulation_report,
)
from .design_sections import CamSection, design_sections, tolerance_sections
from .design_sections import write_design_report as write_design_report
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
from .side_by_side import ComparedResult as ComparedResult
from .side_by_side import differing_numbers as differing_numbers
from .side_by_side import key_figures as key_figures
from .side_by_side import write_comparison
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
    "numbers_table",
    "tolerance_sections",
    "verdict_sections",
    "write_comparison",
    "write_report",
]
