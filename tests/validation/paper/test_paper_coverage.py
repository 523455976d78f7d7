"""Every numbered equation, table, figure and checkable sentence has its item, or a reason why not.

A value is a tuple of items, or the reason in words.
"""

from __future__ import annotations

import pytest

from validation.paper.items import ITEMS

Covered = dict[str, tuple[str, ...] | str]

EQUATIONS: dict[int, tuple[str, ...] | str] = {
    1: ("eq1",),
    2: "Newton's law: the equation every route solves",
    3: ("eq3",),
    4: ("eq5", "eq7"),
    5: ("eq5",),
    6: ("eq6",),
    7: ("eq7",),
    8: ("eq9",),
    9: ("eq9",),
    10: ("eq6",),
    11: ("eq5", "dof-13"),
    12: ("eq6",),
    13: "names the blocks of H",
    14: ("eq14",),
    15: ("eq15", "kernel"),
    16: ("eq17",),
    17: ("eq17",),
    18: ("eq31",),
    19: ("eq19", "eq19-lower-left"),
    20: ("eq20",),
    21: ("eq21",),
    22: ("eq22",),
    23: ("appendix-definite",),
    24: ("appendix-definite", "eq6"),
    25: ("appendix-symmetry", "appendix-definite"),
    26: ("appendix-definite",),
    27: ("appendix-definite",),
    28: ("eq31",),
    29: ("eq31",),
    30: ("eq31",),
    31: ("eq31",),
}

TABLES: dict[int, tuple[str, ...] | str] = {
    1: ("table1", "hub-unit"),
    2: ("table2", "table2-radii", "table3-parameters"),
    3: ("table3",),
    4: ("table4",),
}

FIGURES: dict[int, tuple[str, ...] | str] = {
    1: "a sketch of the drivetrain",
    2: "a sketch of a mesh; its formula is Eq. (1)",
    3: ("fig3a", "fig3b"),
    4: ("fig4a", "fig4b", "h-11"),
    5: ("fig5a", "fig5b"),
    6: ("fig6a", "fig6b", "fig6b-planet2"),
    7: ("fig7",),
    8: ("fig8a", "fig8b", "fig8c"),
    9: ("fig9a", "fig9b", "fig9c"),
    10: ("fig10a", "fig10b"),
    11: ("fig11a", "fig11b"),
    12: ("fig12a", "fig12b"),
    13: ("fig13a", "fig13b"),
    14: ("fig14",),
    15: ("fig15a", "fig15b"),
    16: ("fig16a", "fig16b"),
}

SENTENCES: Covered = {
    # Abstract and Sec. 1
    "a rapid computation where one subsystem is replaced by one with a known FRF": ("time",),
    "substructuring is of interest for damage detection": "an outlook, nothing is computed",
    # Sec. 2
    "eight DoFs rather than the ten of Kahraman": ("kahraman",),
    "the gear mesh stiffness is assumed constant": ("eq3",),
    "a rigid coupling of inertia I_A": ("eq7",),
    "each component of the planetary train has three DoFs": ("eq5",),
    "the carrier and the output shaft are free at their boundaries": ("table3",),  # its 0 Hz
    "damping is neglected": "an assumption, which the figures follow",
    "the coupling is divided into two equal parts": ("eq6",),
    "beta = 0 is the helix angle": ("eq9",),
    # Sec. 3
    "compatibility, and equality with opposite signs of the forces": ("eq15",),
    "for the flexible joint the kernel is replaced": ("kernel",),
    "for proportionally damped systems the FRF is a sum over modes": ("eq17",),
    "[H]_ab = 0": ("eq19",),
    "no external force is applied at the slaves": ("eq31",),
    # Sec. 4.1
    "the parameters are given in Tables 1 and 2": ("table3-parameters",),
    "a good accuracy against Kahraman's results": ("kahraman",),
    "the peaks correspond to the natural frequencies of subsystem A": ("fig3a", "fig3b"),
    "these peaks present the rotation and the bending modes": ("fig3-modes",),
    "frequencies and multiplicities for N = 3, 4, 5 are those of Lin and Parker": ("lin-parker",),
    "three types of modes": ("lin-parker",),  # whose modes are counted by kind
    "the peaks correspond to the natural frequencies of subsystem B": ("fig4a", "fig4b"),
    "H_11 is the translational FRF in the radial direction": ("h-11",),
    "frequencies of the full system are those of the individual stages": ("unchanged-modes",),
    "the changed modes are classified as global modes": ("unchanged-modes", "table3"),
    "the output shaft follows the rotation of the sun": ("eq7",),
    "the two curves are identical": ("fig5a", "fig5b", "coupled-equals-full"),
    "the computational time is reduced by 70 %": ("time",),
    "the peak frequencies of H_99 agree": ("fig6a",),
    "DoF 13 is the second planet's u": ("fig6b", "dof-13"),
    "H_9,10 agrees except a small difference in magnitude": ("fig7", "h-9-10"),
    "a good agreement for all FRFs": ("coupled-equals-full",),
    # Sec. 4.2
    "the same frequencies in both methods, a small difference in magnitude": ("fig8a", "fig8b"),
    "the difference becomes considerable with stiffness": ("difference-grows", "fig8c"),
    "a new frequency in the coupled FRF": ("new-frequency", "fig8c"),
    "the new frequency is not in the second radial FRF": ("second-radial",),
    "new frequencies in the two radial directions": ("second-radial",),
    "the radial FRF is sensitive to shaft stiffness": ("sun-radial",),
    "the difference in frequencies grows with shaft stiffness": ("fig9a", "fig9b", "fig9c"),
    "the coupled curve is slightly higher than the full one": ("difference-grows",),
    "the overall system's frequencies are sensitive to coupling stiffness": ("shaft-frequencies",),
    "for a decreased stiffness the frequencies decrease": ("shaft-frequencies",),
    "both methods agree in rotational degrees; Table 4": ("table4", "frequencies-differ"),
    "frequencies of B shift to lower ones in AB": ("b-shifts-down",),
    # Sec. 4.3
    "condensed and non-condensed A are superposed radially": ("fig10a",),
    "small differences in the rotational direction": ("fig10b",),
    "the peak around 2000 Hz shifts rearward": ("peak-at-2000",),
    "the peak around 70 Hz is due to the coupling DoF": ("peak-at-70",),
    "a new frequency in B, the coupling frequency": ("fig11b",),
    "condensed and non-condensed B are superposed radially": ("fig11a",),
    "A is more sensitive to condensation than B": ("a-more-condensed",),
    "frequencies of condensed A shift down with the stiffness": ("fig12a", "fig12b"),
    # Sec. 4.4
    "truncating B: no effect but for the coupling mode": ("fig13a", "fig13b", "modes-beyond"),
    "the coupling mode is sensitive to truncation": ("coupling-mode",),
    "frequencies around 1400, 1800, 2500 and 2650 Hz": ("fig13-peaks",),
    "peaks in Fig. 13 are frequencies of A": ("a-in-b",),
    "truncated B is sensitive to the shaft stiffness": ("fig14",),
    "the truncated nine modes do not affect the FRF": ("modes-beyond",),
    "without condensation: no effect in the rotational direction": ("fig15a",),
    "without condensation: an effect at the coupling DoF": ("fig15b",),
    "A: some difference, the same with all modes truncated": ("fig16a",),
    "A: not sensitive in the radial direction": ("fig16b",),
    "peaks of A are rotational frequencies of B": ("b-in-a",),
    "all modes beyond the band but the coupling DoF's can be neglected": ("modes-beyond",),
    "truncation does not affect outside the frequency range": ("outside-band",),
    "truncating B affects A more than B": ("b-affects-a",),
    "the accuracy depends on the selected modes": ("modes-beyond",),
    # Sec. 5
    "a small difference in magnitude and frequency due to the shafts' stiffness": (
        "difference-grows", "frequencies-differ",
    ),
    "the coupling method reduces the computational time": ("time",),
}  # fmt: skip

ALL: Covered = {
    **{f"Eq. ({n})": by for n, by in EQUATIONS.items()},
    **{f"Table {n}": by for n, by in TABLES.items()},
    **{f"Fig. {n}": by for n, by in FIGURES.items()},
    **SENTENCES,
}


def test_all_that_is_numbered_is_listed() -> None:
    assert list(EQUATIONS) == list(range(1, 32))
    assert list(TABLES) == list(range(1, 5))
    assert list(FIGURES) == list(range(1, 17))


@pytest.mark.parametrize("what", ALL)
def test_it_has_an_item_or_a_reason(what: str) -> None:
    by = ALL[what]
    if isinstance(by, str):
        assert len(by.split()) > 2
    else:
        assert set(by) <= {each.id for each in ITEMS}
        assert by


def test_every_item_stands_for_something() -> None:
    named = {id for by in ALL.values() if not isinstance(by, str) for id in by}
    assert named == {each.id for each in ITEMS}
