"""The report's sections on the model: its drawing, where its modes' energy sits, their shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from markupsafe import Markup

from mbs_models.gears.resonances import Crossing, Margin

from ..picture.axial import draw_shafts
from ..picture.drawing import draw_model
from ..picture.energy_map import energy_map
from ..picture.layout import lay_out
from ..picture.mode_shapes import MOST, draw_mode_shapes
from ..report.digits import hertz
from ..report.page import Block, Folded, Fragment, Note, Picture, Section, Table
from ..report.pages import environment
from ..report.style import KIND_COLORS
from .describe import short_frequency
from .resonances import LISTED, Resonances, phasing_rules
from .result import CrossCheck

FOLDED = 30  # more modes than that are folded away
KEYS = Markup(
    '<span class="key mesh-key"></span>mesh <span class="key bearing-key"></span>bearing '
    '<span class="key torsion-key"></span>torsion: shaft, rocking or torsional support'
)


def drawing_section(result: CrossCheck) -> Section:
    """The drivetrain as exudyn has it."""
    layout = lay_out(result.drivetrain, result.components)
    return Section(
        "drawing",
        "The drivetrain",
        (
            "Drawn from the exudyn system that is analysed: every spring stands where exudyn has "
            "it, between the points it holds. Circles are the parameters’: base circles in full, "
            "pitch circles in dashes. Point at a body or spring for its name and value.",
            Picture(
                draw_shafts(result.drivetrain, layout, result.components),
                "Shafts, from the side",
                Markup("Heights to scale, lengths not; inertias and hubs not. {}").format(KEYS),
                "drawn",
            ),
            Picture(
                draw_model(result.drivetrain, layout),
                "Stages, along the shafts",
                "To scale, all seen from the same side. Meshes lie on their lines of action, "
                "between the tangent points (dots); planets’ bearings along their radial and "
                "tangential directions; hubs and inertias, which only turn, are not to scale.",
                "drawn",
            ),
        ),
    )


def energy_section(result: CrossCheck) -> Section:
    """Which body moves and which spring strains."""
    modes, shares = result.modes.modes, result.component_energy
    rows = tuple(
        (
            str(number),
            hertz(mode.frequency_hz),
            str(mode.kind),
            _most(shares.most("kinetic", number - 1)),
            _most(shares.most("strain", number - 1)),
        )
        for number, mode in enumerate(modes, start=1)
    )
    headings = ("No.", "Hz", "Kind", "Kinetic energy in", "Strain energy in")
    table = Table(headings, rows, frozenset({0, 1}), "energies")
    return Section(
        "energy",
        "Energy by component",
        (
            "Which body moves and which spring strains, as shares of each mode’s kinetic and "
            "strain energy: a mode is excited most through, and shifted most by changing, what "
            "holds most of its energy.",
            Picture(energy_map(shares, modes)),
            Folded(
                "The three components with most energy, by mode", (table,), len(modes) <= FOLDED
            ),
        ),
    )


def _most(shares: Sequence[tuple[str, float]]) -> str:
    part = Markup('<span class="part"><b>{:.0f} %</b> {}</span>')
    return Markup("").join(part.format(100 * share, name) for name, share in shares) or "–"


def shapes_section(result: CrossCheck) -> Section:
    """Mode shapes, one of them moving."""
    modes = result.modes.modes
    layout = lay_out(result.drivetrain, result.components)
    shapes = draw_mode_shapes(layout, result.components, result.modes)
    elastic = [number for number, mode in enumerate(modes, start=1) if mode.frequency_hz > 0.0]
    moving = elastic[0] if elastic and elastic[0] <= MOST else 1
    html = _fragment(
        "shapes.html",
        shapes=shapes,
        kinds={mode.kind: KIND_COLORS[mode.kind] for mode in modes[:MOST]},
        moving=moving,
        short=short_frequency,
    )
    return Section("shapes", "Mode shapes", (Fragment(html),))


def _fragment(template: str, **values: Any) -> str:
    return environment().get_template(template).render(**values)


def resonance_sections(result: CrossCheck) -> Iterator[Section]:
    """The Campbell diagram, margins at the operating speed, crossings."""
    found = result.resonances
    if found is None:
        return
    yield _campbell(result, found)
    if found.speed_rpm is not None:
        yield _margins(found)
    yield _crossings(result, found)


def _campbell(result: CrossCheck, found: Resonances) -> Section:
    first, last = found.speed_range
    blocks: list[Block] = [
        "Natural frequencies (horizontal, coloured by kind) against the shafts’ and meshes’ "
        f"orders, for {found.operation.input} from {first:g} to {last:g} rpm. All speeds follow "
        "from the motion that strains no spring. A dot’s area grows with the share of the mode’s "
        "energy that the order excites: strain energy of the stage’s meshes, or kinetic energy of "
        "the shaft’s bodies."
        + (
            " Hollow: the planets’ meshes push in a phase in which they cannot excite the mode."
            if found.suppressed
            else ""
        )
    ]
    if rules := "; ".join(f"{order} {rule}" for order, rule in phasing_rules(found.orders)):
        blocks.append(
            Note(
                f"Planet phasing, what each harmonic excites in its stage: {rules}. A harmonic "
                "that is not rotational puts no net torque on sun, ring and carrier: nothing "
                "outside the stage turns with it."
            )
        )
    from .campbell_figure import campbell_figure  # matplotlib: only where it is drawn

    blocks.append(Picture(campbell_figure(found, result.modes.modes)))
    return Section("campbell", "Campbell diagram", tuple(blocks))


def _margins(found: Resonances) -> Section:
    close = (
        f"{len(found.close)} of {len(found.margins)} within ±10 %, in bold: at 0.9 and 1.1 of a "
        "resonance the response is five times the static one, whatever the damping, and rises "
        "from there."
        if found.close
        else "None is within ±10 %."
    )
    return Section(
        "margins",
        f"At {found.speed_rpm:g} rpm",
        (
            f"The nearest resonance of every order of {found.operation.input}, and by how much the "
            f"speed must change to meet it. {close}",
            margin_table(found.margins),
        ),
    )


def margin_table(margins: Sequence[Margin]) -> Table:
    """Nearest resonances at one speed."""
    rows = tuple(
        (
            margin.order.label(margin.harmonic),
            hertz(margin.order_hz),
            hertz(margin.mode_hz),
            f"{margin.mode + 1}" + (f"–{margin.mode + margin.repeated}" * (margin.repeated > 1)),
            str(margin.kind),
            f"{100 * margin.share:.1f} %",
            f"{100 * margin.change:+.1f} %".replace("-", "−"),
        )
        for margin in margins
    )
    return Table(
        (
            "Order", "Order (Hz)", "Nearest resonance (Hz)", "Mode", "Kind", "Energy share",
            "Speed change",
        ),
        rows,
        frozenset({1, 2, 3, 5, 6}),
        "crossings",
        {number: "close" for number, margin in enumerate(margins) if margin.close},
        "No order excites a hundredth of any mode’s energy.",
    )  # fmt: skip


def _crossings(result: CrossCheck, found: Resonances) -> Section:
    listed, kinds = found.listed, [mode.kind for mode in result.modes.modes]
    rows = tuple(_crossing(crossing, kinds[crossing.mode]) for crossing in listed)
    which = "those" if len(listed) < LISTED else f"the {LISTED}"
    more = (
        f" {found.suppressed} more hold as much in the stage’s meshes but are suppressed by planet "
        "phasing."
        if found.suppressed
        else ""
    )
    return Section(
        "crossings",
        "Crossings",
        (
            Table(
                (
                    "Order", "per turn", "Crossing at (rpm)", "Frequency (Hz)", "Mode", "Kind",
                    "Energy share",
                ),
                rows,
                frozenset({1, 2, 3, 4, 6}),
                "crossings",
                empty="No order in this range excites a hundredth of the energy of a mode that it "
                "meets.",
            ),
            Note(
                f"{len(listed)} of {len(found.crossings)} crossings: {which} with most energy: at "
                f"least 1 %, or less of modes that are lightly damped.{more} Stages whose teeth "
                "are not given have no mesh order here."
            ),
        ),
    )  # fmt: skip


def _crossing(crossing: Crossing, kind: str) -> tuple[str, ...]:
    return (
        crossing.order.label(crossing.harmonic),
        f"{crossing.harmonic * crossing.order.factor:.4g}",
        f"{crossing.speed_rpm:.4g}",
        hertz(crossing.frequency_hz),
        str(crossing.mode + 1),
        str(kind),
        f"{100 * crossing.share:.1f} %",
    )
