"""Every item of the paper, in the paper's order, and how one is picked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches

from ..errors import CommandError
from . import (
    appendix,
    condensation,
    condensed_figures,
    coupling,
    formulas,
    parameter_tables,
    parameters,
    tables,
    timing,
    truncation,
    varying_stiffness,
)
from .condensed_figures import FIG_10, FIG_11, FIG_12
from .figures import FIG_3, FIG_4, FIG_5, FIG_6, FIG_7, FIGS_8_AND_9
from .item import Statement
from .truncated_figures import FIG_13, FIG_14, FIG_15, FIG_16

ITEMS: tuple[Statement, ...] = (
    # Sec. 2, motion equation
    formulas.ring_mesh,
    varying_stiffness.constant_stiffness,
    formulas.order_of_dofs,
    formulas.mass_matrices,
    formulas.wheel_and_hub,
    formulas.mesh_of_a,
    # Sec. 3, theoretical formulation
    condensation.third_row,
    formulas.coupling_sign,
    formulas.flexible_kernel,
    formulas.sum_over_modes,
    condensation.between_stages,
    condensation.lower_left,
    condensation.condensed_hub_and_b,
    condensation.condensed_a,
    condensation.condensed_b,
    # Sec. 4.1, validation
    parameter_tables.parallel_stage,
    parameter_tables.planetary_stage,
    parameters.base_radii,
    parameters.hub_unit,
    parameters.kahraman,
    parameters.lin_parker,
    parameters.table_3_parameters,
    *FIG_3,
    parameters.rotation_and_bending,
    *FIG_4,
    coupling.h_11,
    coupling.unchanged_modes,
    tables.full_system_frequencies,
    *FIG_5,
    timing.computing_time,
    *FIG_6,
    coupling.dof_13,
    FIG_7,
    coupling.hub_to_sun_u,
    coupling.coupled_equals_full,
    # Sec. 4.2, shaft stiffness
    *FIGS_8_AND_9,
    coupling.difference_grows,
    coupling.new_frequency,
    coupling.second_radial,
    coupling.sun_radial,
    coupling.shaft_frequencies,
    coupling.frequencies_differ,
    tables.rotational_modes,
    coupling.b_shifts_down,
    # Sec. 4.3, condensation
    *FIG_10,
    condensed_figures.peak_at_2000,
    condensed_figures.peak_at_70,
    *FIG_11,
    condensed_figures.a_more_condensed,
    *FIG_12,
    # Sec. 4.4, modal truncation
    *FIG_13,
    truncation.frequencies_of_truncation,
    truncation.frequencies_of_a,
    FIG_14,
    *FIG_15,
    *FIG_16,
    truncation.frequencies_of_b,
    truncation.modes_beyond,
    truncation.outside_band,
    truncation.truncation_felt,
    truncation.coupling_mode,
    # Appendices
    appendix.symmetry,
    appendix.definiteness,
    condensation.condensed_receptance,
)

NUMBERED = re.compile(r"(fig\d+)")


def groups(items: Sequence[Statement] = ITEMS) -> dict[str, tuple[Statement, ...]]:
    """Names that stand for several items: a figure of several parts, a subject, all claims."""
    found: dict[str, list[Statement]] = {}
    for each in items:
        figure = NUMBERED.match(each.id) if each.subject == "figures" else None
        kind = () if each.subject in ("figures", "tables") else ("claims",)
        for name in (*((figure[1],) if figure else ()), each.subject, *kind):
            found.setdefault(name, []).append(each)
    return {name: tuple(members) for name, members in found.items()}


def picked(text: str, option: str = "--only") -> tuple[Statement, ...]:
    """The item, or those of the group, that a text names: ``Fig. 8``, ``table3``, ``truncation``.

    Raises
    ------
    CommandError
        There is none of that name; the message gives the nearest ones.
    """
    named: dict[str, tuple[Statement, ...]] = {**groups(), **{each.id: (each,) for each in ITEMS}}
    asked = re.sub(r"[\s.]", "", text).lower()
    if asked in named:
        return named[asked]
    names = [name for name in named if not re.match(r"fig\d+\D", name)]
    nearest = get_close_matches(asked, dict.fromkeys((*names, *named)), n=4, cutoff=0.5)
    known = f"nearest: {', '.join(nearest)}; " if nearest else ""
    raise CommandError(
        f"{option} = {text!r}: there is no such item; {known}there are {', '.join(names)}, and "
        "the parts of a figure, like fig8a"
    )
