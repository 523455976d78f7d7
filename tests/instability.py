"""Where a periodically stiff system begins to grow, for the tests that know it."""

from __future__ import annotations

from validation.errors import CommandError
from validation.routes.floquet import ParametricSystem, growth_rate


def instability_boundary(
    system: ParametricSystem,
    stable: float,
    unstable: float,
    *,
    threshold: float = 1e-6,
    tolerance: float = 1e-6,
) -> float:
    """Mesh frequency (Hz) between a stable and an unstable one where motions begin to grow.

    Parameters
    ----------
    system
        The varying meshes.
    stable, unstable
        Mesh frequencies (Hz) on the two sides.
    threshold
        ln|μ| that counts: above what round-off makes of multipliers on the unit circle.
    tolerance
        Relative, of the frequency.

    Raises
    ------
    CommandError
        The two are not on different sides.
    """

    def growing(frequency: float) -> bool:
        return growth_rate(system, frequency) > threshold * frequency

    grows = [growing(stable), growing(unstable)]
    if grows != [False, True]:
        words = {True: "unstable", False: "stable"}
        raise CommandError(
            f"no boundary between {stable:g} Hz ({words[grows[0]]}) and {unstable:g} Hz "
            f"({words[grows[1]]}): the first must be stable, the second unstable"
        )
    while abs(unstable - stable) > tolerance * unstable:
        middle = (stable + unstable) / 2.0
        if growing(middle):
            unstable = middle
        else:
            stable = middle
    return (stable + unstable) / 2.0
