"""The paper, checked: every table, figure, equation and claim, each with a computed verdict."""

from .item import Verdict
from .result import PaperStudy
from .study import paper_study
from .tables import RowVerdict

__all__ = ["PaperStudy", "RowVerdict", "Verdict", "paper_study"]
