"""The page of a cross-check: head and sections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup

from mbs_models.modal.mode_kinds import Mode
from mbs_models.model.model_file import dumps

from ..checks.pole_checks import PoleRow
from ..explorer.plots import PAGE as EXPLORER
from ..report.digits import grouped, hertz, scientific
from ..report.page import (
    Block,
    Bullets,
    Definitions,
    Fact,
    Note,
    Page,
    Picture,
    Preformatted,
    Section,
    Table,
    Verdict,
    Verdicts,
    source_of,
)
from ..report.style import (
    CURVE_COLUMNS,
    ERROR_COLUMNS,
    part_colors,
)
from ..routes.time_domain import TimeDomain
from .describe import describe_pair, describe_route, disagreements, verdict
from .figures import (
    curve_figure,
    error_figure,
    kernel_figure,
    shares_figure,
    time_figure,
)
from .heat_map import heat_map
from .model_sections import drawing_section, energy_section, resonance_sections, shapes_section
from .quality_section import quality_section
from .result import ARRAYS, CrossCheck
from .substitution_section import substitution_section

SHOWN = 3  # findings of a pair of routes in the verdict
VISIBLE = 0.004  # of a bar: smaller shares are not drawn
LABEL = Markup('<span class="label">{}</span>')
SMALL = Markup("{}<small>{}</small>")
CONVENTIONS = (
    Markup(
        "SI units; frequency in Hz. e<sup>+jωt</sup>; H(ω) = (K − ω²M + jωC)<sup>−1</sup>, "
        "receptance in m/N."
    ),
    "Rotations are carried as w = r·θ in metres, r the base radius (carrier: planet-centre circle; "
    "coupling: its radius), so that every receptance is in m/N; the conjugate force is torque / r.",
    Markup(
        "DoFs are labelled stage.body.dof: <code>w</code> rotation, <code>y</code> along the line "
        "of action, <code>z</code> axial, <code>rho</code> rocking (r·ρ), <code>u</code> and "
        "<code>v</code> in the plane of a planetary stage (of a planet: radial and tangential)."
    ),
    "Damping is element-wise: every spring has c = βk, every inertia αM.",
    "Multibody eigenfrequencies are exudyn’s own; FBS’ poles are found in its coupled FRFs, "
    "filtered by mode shape.",
)
SHARED = (
    Markup(
        "<strong>exudyn and equations</strong> share no formula: one places bodies and springs in "
        "space and lets exudyn differentiate the forces; the other writes K = Σ k v vᵀ. Their "
        "agreement confirms geometry, directions and signs."
    ),
    Markup(
        "<strong>Whole and FBS</strong> share the stages’ elements but not their assembly: FBS "
        "never sees the whole drivetrain’s matrices. Their agreement confirms the split of the "
        "hubs and the coupling."
    ),
    Markup(
        "<strong>Line by line and modal synthesis</strong> share the matrices but not the "
        "solution. Their agreement confirms eigensolution, normalisation and damping."
    ),
    Markup(
        "<strong>What no comparison here can show:</strong> a wrong parameter is wrong in every "
        "route. Published values, where a preset has them, are the check on that."
    ),
)
EXPLORE = Markup(
    '<a href="{}">Explore every other FRF</a>: computed as you ask, springs and damping to drag.'
).format(EXPLORER)
UNCOUPLED = "Nothing is coupled in this model: FBS’ FRFs are those of its stages as they stand."


def report_page(result: CrossCheck) -> Page:
    """What report.html says."""
    drivetrain = result.drivetrain
    sections = [
        drawing_section(result),
        Section(
            "verdicts",
            "1 Verdicts",
            ("Every comparison of two routes.", Verdicts(result.checks)),
        ),
        _modes(result),
        _frfs(result),
        _routes(result),
        Section(
            "model",
            "5 Model",
            ("The model file that gives this drivetrain:", Preformatted(dumps(drivetrain))),
        ),
    ]
    if result.substitution is not None:
        changes = result.substitution
        swap = substitution_section(drivetrain, changes, result.frequency, result.reference)
        sections[:0] = [swap, quality_section(changes)]
    return Page(
        eyebrow="Drivetrain cross-check",
        heading=drivetrain.name,
        title="routes agree" if result.agrees else "routes disagree",
        source=source_of(drivetrain.source),
        verdict=Verdict(verdict(result), result.agrees),
        conclusions=_conclusions(result),
        warnings=result.warnings,
        facts=_facts(result),
        sections=tuple(sections),
        timings=result.timings,
        footer=f"numbers are in results.json, every line of every curve in {ARRAYS} beside it",
        styles=("model.css",),
    )


def _conclusions(result: CrossCheck) -> tuple[Block, ...]:
    return (*_outcome(result), *((EXPLORE,) if result.explorer else ()))


def _outcome(result: CrossCheck) -> tuple[Block, ...]:
    count, agreed = len(result.checks), sum(check.agrees for check in result.checks)
    if result.agrees:
        return (
            f"{len(result.comparisons)} routes against {result.reference}, {agreed} comparisons, "
            "each within its tolerance.",
        )
    more = Markup(
        '<span class="small">and {} more in the <a href="#verdicts">table of verdicts</a></span>'
    )
    entries = []
    for routes, findings in disagreements(result).items():
        rest = len(findings) - SHOWN
        told = findings[:SHOWN] + ((more.format(rest),) if rest > 0 else ())
        entries.append((" ↔ ".join(routes), told))
    return (
        f"{count - agreed} of {count} comparisons are beyond their tolerance:",
        Definitions(tuple(entries)),
    )


def _facts(result: CrossCheck) -> tuple[Fact, ...]:
    worst, lines, modes = result.worst, result.frequency, result.modes.modes
    at, response, excitation = worst.worst
    kinds = Counter(str(mode.kind) for mode in modes)
    agreed = sum(check.agrees for check in result.checks)
    return (
        Fact(
            "Largest scaled error of any FRF",
            scientific(worst.largest),
            f"{worst.route}, {at:g} Hz, {response} ← {excitation}",
        ),
        Fact(
            "FRFs × frequency lines",
            f"{grouped(len(result.dofs) ** 2)} × {grouped(len(lines))}",
            f"{len(result.dofs)} DoFs, {lines[0]:g} to {lines[-1]:g} Hz, by "
            f"{len(result.comparisons) + 1} routes",
        ),
        Fact(
            "Comparisons within tolerance",
            f"{agreed} of {len(result.checks)}",
            "matrices, poles, mode shapes, FRFs",
        ),
        Fact(
            "Modes",
            str(len(modes)),
            ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())),
        ),
    )


# --- 2 modes --------------------------------------------------------------------------------


def _modes(result: CrossCheck) -> Section:
    drivetrain = result.drivetrain
    colors = part_colors([part.name for part in drivetrain.items])
    key = Markup("").join(
        Markup('<span class="key" style="background:{}"></span>{}').format(color, part)
        for part, color in colors.items()
    )
    return Section(
        "modes",
        "2 Modes",
        (
            "All modes, rigid-body modes first. Beside each frequency stands its relative "
            f"difference from {result.reference}; round-off is how far the eigensolution’s own "
            f"rounding may move {result.reference}’s frequency. The kind follows from where "
            "kinetic and strain energy sit.",
            Picture(
                shares_figure(result),
                "Energy by stage and coupling",
                "One bar per mode, labelled with its natural frequency in Hz.",
            ),
            _mode_table(result, colors),
            Note(
                Markup(
                    "Kinetic and strain energy: {}. Damping ratio: {}’s, with the largest "
                    "difference of any route. 1 − MAC: the largest of any route, in the metric of "
                    "M; repeated modes are compared as subspaces. A rigid-body mode has no strain "
                    "energy, and no pole that FBS could be asked for."
                ).format(key, result.reference)
            ),
            energy_section(result),
            shapes_section(result),
            *resonance_sections(result),
        ),
    )


def _mode_table(result: CrossCheck, colors: Mapping[str, str]) -> Table:
    routes = list(dict.fromkeys(route for pole in result.poles for route in pole.frequency_hz))
    rows = tuple(
        _mode_row(number, mode, pole, routes, result.reference, colors)
        for number, (mode, pole) in enumerate(
            zip(result.modes.modes, result.poles, strict=True), start=1
        )
    )
    n = len(routes)
    return Table(
        (
            "No.", "Kind", *(f"{route} (Hz)" for route in routes), "Damping ratio", "1 − MAC",
            "Kinetic", "Strain", "Round-off (Hz)",
        ),
        rows,
        frozenset({0, *range(2, n + 4), n + 6}),
        "modes",
    )  # fmt: skip


def _mode_row(
    number: int,
    mode: Mode,
    pole: PoleRow,
    routes: Sequence[str],
    reference: str,
    colors: Mapping[str, str],
) -> tuple[str, ...]:
    """The reference's frequency, and every other route's with its relative difference."""
    f, zeta = pole.frequency_hz[reference], pole.damping_ratio[reference]

    def frequency(route: str) -> str:
        if route not in pole.frequency_hz:
            return "–"
        other = pole.frequency_hz[route]
        if route == reference:
            return hertz(other)
        return SMALL.format(hertz(other), scientific((other - f) / f if f else other, signed=True))

    damping = max(abs(other - zeta) for other in pole.damping_ratio.values())
    defect = max((0.0, *(1.0 - mac for mac in pole.subspace_mac.values())))
    return (
        str(number),
        str(mode.kind),
        *map(frequency, routes),
        SMALL.format(scientific(zeta, 4), f"Δ {scientific(damping)}"),
        scientific(defect),
        _share_bar(mode.shares.kinetic, colors),
        _share_bar(mode.shares.strain, colors),
        scientific(pole.round_off_hz),
    )


def _share_bar(shares: Mapping[str, float], colors: Mapping[str, str]) -> str:
    words = ", ".join(f"{part} {100 * share:.1f} %" for part, share in shares.items())
    bar = Markup("").join(
        Markup('<span style="width:{:.1f}%;background:{}"></span>').format(100 * s, colors[part])
        for part, s in shares.items()
        if s >= VISIBLE
    )
    return Markup('<div class="share" role="img" aria-label="{0}" title="{0}">{1}</div>').format(
        words, bar
    )


# --- 3 FRFs ---------------------------------------------------------------------------------


def _frfs(result: CrossCheck) -> Section:
    worst, lines, dofs = result.worst, grouped(len(result.frequency)), len(result.dofs)
    blocks: list[Block] = [
        Markup(
            "All {} FRFs of {} DoFs, on {} lines, each route against {}. The scaled error is "
            "|ΔH<sub>ij</sub>| / √(h<sub>i</sub> h<sub>j</sub>) per line, h<sub>i</sub> the norm "
            "of row i of H: antiresonances, and DoFs of different size, are compared alike."
        ).format(grouped(dofs**2), dofs, lines, result.reference),
        _comparison_table(result),
        Note(
            "FRAC is shown because it is widely used, and is never trusted alone: the few lines at "
            "the peaks decide it. A truncated model scores 0.993 while it is 45 dB wrong elsewhere."
        ),
        Picture(
            error_figure(result),
            "Scaled error over frequency",
            f"The largest of each of {ERROR_COLUMNS} columns is drawn. The tolerance rises where "
            "round-off of the stiffness alone explains more: at undamped poles, and towards 0 Hz "
            "of a free drivetrain.",
        ),
        Picture(
            heat_map(worst, result.dofs),
            f"Which FRFs: {worst.route}",
            "Largest scaled error of every FRF over all lines, for the route with the largest; "
            f"those of the other routes are in {ARRAYS}.",
            "narrow",
        ),
    ]
    if len(result.kernel_condition):
        blocks.append(
            Picture(
                kernel_figure(result),
                "Conditioning of the interface kernel",
                "How many times larger a relative error of the stages’ interface FRFs becomes in "
                "the interface forces when FBS couples them; times 1.1e−16 it is the coupling’s "
                "own round-off.",
            )
        )
    blocks.append(
        Section(
            "",
            "Curves",
            (
                "Above: where the modes lie, by kind. Middle: the receptance by every route; where "
                f"routes coincide, their dashes take turns on the grey line of {result.reference}. "
                "Below: each route’s relative difference from it, line by line (there, an "
                "antiresonance makes any difference look large: the scaled error decides). Curves "
                "are drawn with the extreme values of each of some "
                f"{CURVE_COLUMNS} columns, differences with the largest of each of half as many; "
                f"every line is in {ARRAYS}.",
            ),
        )
    )
    for number, pair in enumerate(result.curves, start=1):
        response, excitation = pair
        blocks.append(
            Picture(
                curve_figure(result, number, pair),
                LABEL.format(f"{response} ← {excitation}"),
                describe_pair(result.drivetrain, response, excitation),
            )
        )
    if result.time_domain is not None:
        blocks.append(_time(result.time_domain, result.drivetrain.damping))
    return Section("frfs", "3 FRFs", tuple(blocks))


def _comparison_table(result: CrossCheck) -> Table:
    rows = []
    for each in result.comparisons:
        at, response, excitation = each.worst
        smallest, curve = each.frac
        rows.append(
            (
                each.route,
                scientific(each.largest),
                f"{at:g}",
                LABEL.format(f"{response} ← {excitation}"),
                scientific(float(np.median(each.line_max))),
                scientific(1 - smallest),
                LABEL.format(curve),
            )
        )
    headings = (
        "Route", "Largest scaled error", "at (Hz)", "Response ← excitation", "Median line’s",
        "1 − smallest FRAC", "of",
    )  # fmt: skip
    return Table(headings, tuple(rows), frozenset({1, 2, 4, 5}), "routes compared")


def _time(found: TimeDomain, own: object) -> Section:
    """FRFs of the run in time beside FBS'; ``own`` is the model's damping."""
    lines, damping = found.frequency, found.damping
    damped = (
        "Both routes have the model’s own damping."
        if damping == own
        else "The model has no damping, so that both routes were given Rayleigh damping of 0.5 % "
        f"at 40 Hz and 1 kHz (α = {damping.mass_proportional:.4g} 1/s, "
        f"β = {damping.stiffness_proportional:.4g} s)."
    )
    return Section(
        "time",
        "The same FRFs from time integration",
        (
            Markup(
                "exudyn integrates the multibody system itself over one period of its steady state "
                "under a multisine at <code>{}</code> (lines every {:.3g} Hz up to {:.0f} Hz); the "
                "FRFs are the ratio of the records’ spectra. No linear algebra of the other routes "
                "is in them. {}"
            ).format(found.excitation, lines[1] - lines[0], lines[-1], damped),
            Picture(time_figure(found)),
            Note(
                f"Largest difference {scientific(found.worst_db.max())} dB and "
                f"{scientific(found.worst_degrees.max())}° over {len(found.labels)} responses, "
                f"{found.comparable}. A line is compared within 80 dB of its response’s peak, and "
                "below where what does not change sign with the force is less than 0.1 % of it, "
                "there and on the lines about it. Implicit trapezoidal rule, step "
                f"{scientific(found.step)} s, which bends a frequency ω to (2/h) tan(ωh/2): FBS is "
                f"asked there; the orbit closes to {scientific(found.closure)} of each motion. "
                f"{scientific(found.even_share)} of the motion does not change sign with the "
                "force: that is geometry’s share, and it is taken out by a run with the force "
                "reversed."
            ),
        ),
    )


# --- 4 routes -------------------------------------------------------------------------------


def _routes(result: CrossCheck) -> Section:
    rows = []
    for route in (result.reference, *(each.route for each in result.comparisons)):
        mark = " (reference)" if route == result.reference else ""
        name = Markup("<strong>{}</strong>{}").format(route, mark)
        rows.append((name, *describe_route(route)))
    headings = ("Route", "Matrices M, C, K from", "What is solved", "FRF")
    shared = SHARED if len(result.kernel_condition) else (*SHARED[:2], UNCOUPLED, *SHARED[2:])
    return Section(
        "routes",
        "4 Routes and method",
        (
            "All routes read the same parameters. What else they share is listed here: where two "
            "routes agree, whatever they do not share is confirmed.",
            Table(headings, tuple(rows), style="routes"),
            Bullets(shared),
            Section("", "Conventions", (Bullets(CONVENTIONS),)),
        ),
    )
