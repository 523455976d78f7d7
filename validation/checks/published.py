"""Published natural frequencies that a model must reach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mbs_models.modal.mode_kinds import Kind


@dataclass(frozen=True)
class PublishedModes:
    """Published frequencies (Hz).

    Attributes
    ----------
    source
        Where they are printed.
    tolerance, reason
        Largest relative difference, and why that much.
    by_kind
        All modes of a kind, each as often as its multiplicity.
    lowest
        The lowest elastic modes, where no more is published.
    """

    source: str
    tolerance: float
    reason: str
    by_kind: Mapping[Kind, tuple[float, ...]] = field(default_factory=dict)
    lowest: tuple[float, ...] = ()


def _lin_parker(
    rotational: tuple[float, ...], translational: tuple[float, ...], planet: tuple[float, ...]
) -> PublishedModes:
    return PublishedModes(
        "Lin & Parker 1999, J. Vib. Acoust. 121, 316–321, Tables 1 and 2",
        4e-4,
        "the source prints 0.1 Hz; its 727.0 and 1091.0 Hz (N = 4) are 727.27 and 1091.16 by its "
        "own parameters, which is 3.7e-4",
        {
            Kind.RIGID_BODY: (0.0,),
            Kind.ROTATIONAL: rotational,
            Kind.TRANSLATIONAL: tuple(f for f in translational for _ in range(2)),
            Kind.PLANET: planet,
        },
    )


_PLANET = (1808.2, 5963.8, 6981.7)

PUBLISHED: Mapping[str, PublishedModes] = {
    "lin-parker-3": _lin_parker(
        (1475.7, 1930.3, 2658.3, 7462.8, 11775.3),
        (743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9),
        (),
    ),
    "lin-parker-4": _lin_parker(
        (1536.6, 1970.6, 2625.7, 7773.6, 13071.1),
        (727.0, 1091.0, 1892.8, 2342.5, 7189.9, 10437.6),
        _PLANET,
    ),
    "lin-parker-5": _lin_parker(
        (1567.4, 2006.1, 2614.8, 8065.4, 14253.1),
        (710.0, 1072.0, 1888.1, 2425.3, 7382.4, 11172.3),
        tuple(f for f in _PLANET for _ in range(2)),
    ),
    "geared-torsional": PublishedModes(
        "Gunter & Chen 2001, Rotor-Bearing Systems, Example 8.1",
        3e-4,
        "the source prints 0.1 cpm, which is 2.8e-4 of the lowest",
        lowest=(177.7 / 60.0, 220.2 / 60.0, 1282.6 / 60.0),
    ),
    "wind-turbine": PublishedModes(
        "Anaya-Lara et al. 2019, Offshore Wind Energy Technology, ch. 3 (NREL 5-MW drivetrain)",
        2e-2,
        "the published model's shafts and bearings are not printed: Table 5-1's two-inertia "
        "equivalent has 2.22 Hz, and the choices that the sources leave open move it by 2 %",
        lowest=(2.18,),
    ),
}
