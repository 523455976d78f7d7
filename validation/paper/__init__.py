"""The seed paper, checked: every table, figure and claim, each with a verdict that is computed."""

from .json_output import to_json
from .results import PaperStudy, RowVerdict, Verdict
from .study import item_names, paper_study

__all__ = ["PaperStudy", "RowVerdict", "Verdict", "item_names", "paper_study", "to_json"]
