r"""Frequency-based substructuring: FRFs with named DoFs, their synthesis and their coupling.

Conventions: SI; frequency in Hz; e^{+jwt}; H(w) = (K (1 + j eta) - w^2 M + jwC)^-1; FRF values have
shape (n_frequency, n_response, n_excitation).

Systems
    `SecondOrderSystem`, `SparseSystem`.
FRFs
    `Frf` on a `frequency_axis`: `synthesize` chooses among `direct_frf`, `modal_frf`, `schur_frf`;
    `sparse_frf` and `reduced_frf` for large systems, `galerkin_bound`; `Frf.round_off` bounds the
    error. `read_frf`, `write_frf` by a file's ending (a measurement with its notes), `read_uff`,
    `write_uff`; `fbs.measured` for their quality, uncertainty and resampling.
Modes
    `real_modes`, `complex_modes`, `poles`; `truncate` leaves some out and keeps their residuals.
    `bounded_frf` couples `TruncatedPart`s and bounds the error; `smallest_basis` meets a tolerance.
Substructures
    `couple` and `couple_chain` join FRFs at every `Joint`; `condense_free`, `condense_blocked`,
    `condense_dynamic_stiffness` and `block_dofs` leave DoFs out. `MatrixJoint` joins several DoFs,
    a `StiffnessTable` is a joint as measured.
Taking apart
    `decouple`, `decouple_primal`, `decouple_systems`; `joint_between`, `joint_in_situ` and
    `fit_spring` find a joint.
Reductions
    `guyan`, `dynamic`, `irs`, `serep`, `craig_bampton`, `rubin`, `macneal`, `dual_craig_bampton`,
    `projected`: each returns a `Reduction`.
Measured interfaces
    `transform` to `VirtualPoint`s of `Channel`s, `singular_basis`; `semm`, `serep_expansion` spread
    measured FRFs by a model; `source_forces`, `path_contributions`, `transmissibility`;
    `fbs.metrics` compares.
Springs that vary periodically
    `PeriodicSpring`, `steady_state` and its `outputs`, `waveform`, `extremes`; `stability`.
Records
    `Record`; `averaged_frf`, `periodic_frf`, `impulse_frf` estimate FRFs of them.
Errors
    `FbsError`, of which all others are.
"""

from typing import TYPE_CHECKING, Any

from .axes import frequency_axis
from .condensation import (
    CondensedStiffness,
    block_dofs,
    condense_blocked,
    condense_dynamic_stiffness,
    condense_free,
)
from .coupled_bound import BoundedFrf, Reason, ReducedPart, TruncatedPart, bounded_frf
from .coupling import CoupledFrf, couple
from .damped_modes import ComplexModes, complex_modes
from .errors import (
    AmbiguousDofError,
    AxisMismatchError,
    DefectiveModesError,
    FbsError,
    IndefiniteMassError,
    IndefiniteStiffnessError,
    JointError,
    NonFiniteError,
    QuantityMismatchError,
    SingularLineError,
    UnknownDofError,
)
from .frf import Frf, Quantity
from .joints import Joint, MatrixJoint, StiffnessTable
from .large.chain import couple_chain
from .large.galerkin_bound import GalerkinBound, galerkin_bound
from .large.krylov import ReducedFrf, ReductionError, reduced_frf
from .large.sparse_system import SparseSystem, sparse_frf
from .modal_synthesis import modal_frf
from .modal_truncation import TruncatedModes, truncate
from .periodic.floquet import NoCommonPeriodError, Stability, stability, stability_by_period
from .periodic.harmonic_balance import PeriodicResponse, SingularBalanceError, outputs, steady_state
from .periodic.periodic_extremes import Extremes, extremes, waveform
from .periodic.periodic_springs import Lattice, PeriodicSpring, common_periods, lattice
from .schur_form import schur_frf
from .second_order_system import SecondOrderSystem, direct_frf
from .signal.estimation import Estimate, averaged_frf, impulse_frf, periodic_frf
from .signal.records import Record
from .smallest_basis import SmallestBasis, Tolerance, smallest_basis
from .synthesis import Method, MethodError, Synthesis, synthesize
from .system_poles import Poles, poles
from .undamped_modes import RealModes, real_modes

__all__ = [
    "AmbiguousDofError",
    "AxisMismatchError",
    "BoundedFrf",
    "Channel",
    "ComplexModes",
    "CondensedStiffness",
    "CoupledFrf",
    "DecoupledFrf",
    "DefectiveModesError",
    "Estimate",
    "Extremes",
    "FbsError",
    "Frf",
    "GalerkinBound",
    "IndefiniteMassError",
    "IndefiniteStiffnessError",
    "Joint",
    "JointError",
    "JointStiffness",
    "Lattice",
    "MatrixJoint",
    "Method",
    "MethodError",
    "MixedFrf",
    "NoCommonPeriodError",
    "NonFiniteError",
    "PeriodicResponse",
    "PeriodicSpring",
    "Poles",
    "Quantity",
    "QuantityMismatchError",
    "RealModes",
    "Reason",
    "Record",
    "ReducedFrf",
    "ReducedPart",
    "Reduction",
    "ReductionError",
    "SecondOrderSystem",
    "SingularBalanceError",
    "SingularBasis",
    "SingularLineError",
    "SmallestBasis",
    "SourceForces",
    "SparseSystem",
    "Spectra",
    "Spring",
    "Stability",
    "StiffnessTable",
    "Synthesis",
    "Tolerance",
    "Transformed",
    "TruncatedModes",
    "TruncatedPart",
    "UffError",
    "UnknownDofError",
    "VirtualPoint",
    "__version__",
    "averaged_frf",
    "block_dofs",
    "bounded_frf",
    "common_periods",
    "complex_modes",
    "condense_blocked",
    "condense_dynamic_stiffness",
    "condense_free",
    "couple",
    "couple_chain",
    "craig_bampton",
    "decouple",
    "decouple_primal",
    "decouple_systems",
    "direct_frf",
    "dual_craig_bampton",
    "dynamic",
    "extremes",
    "fit_spring",
    "frequency_axis",
    "galerkin_bound",
    "guyan",
    "impulse_frf",
    "irs",
    "joint_between",
    "joint_in_situ",
    "lattice",
    "macneal",
    "modal_frf",
    "outputs",
    "path_contributions",
    "periodic_frf",
    "poles",
    "projected",
    "read_frf",
    "read_uff",
    "real_modes",
    "reduced_frf",
    "rubin",
    "schur_frf",
    "semm",
    "serep",
    "serep_expansion",
    "singular_basis",
    "smallest_basis",
    "source_forces",
    "sparse_frf",
    "stability",
    "stability_by_period",
    "steady_state",
    "synthesize",
    "transform",
    "transmissibility",
    "truncate",
    "waveform",
    "write_frf",
    "write_uff",
]

if TYPE_CHECKING:
    from .decoupling import DecoupledFrf, decouple, decouple_primal, decouple_systems
    from .files.frf_files import read_frf, write_frf
    from .files.uff import read_uff, write_uff
    from .files.universal import UffError
    from .joint_identification import (
        JointStiffness,
        Spring,
        fit_spring,
        joint_between,
        joint_in_situ,
    )
    from .mixing import MixedFrf, SingularBasis, semm, serep_expansion, singular_basis
    from .reduction import (
        Reduction,
        craig_bampton,
        dual_craig_bampton,
        dynamic,
        guyan,
        irs,
        macneal,
        projected,
        rubin,
        serep,
    )
    from .transfer_paths import (
        SourceForces,
        Spectra,
        path_contributions,
        source_forces,
        transmissibility,
    )
    from .virtual_point import Channel, Transformed, VirtualPoint, transform

    __version__: str
else:  # hidden, so that a name that is not there is an error of types
    LAZY = {
        "decoupling": ("DecoupledFrf", "decouple", "decouple_primal", "decouple_systems"),
        "files.frf_files": ("read_frf", "write_frf"),
        "files.uff": ("read_uff", "write_uff"),
        "files.universal": ("UffError",),
        "joint_identification": (
            "JointStiffness",
            "Spring",
            "fit_spring",
            "joint_between",
            "joint_in_situ",
        ),
        "mixing": ("MixedFrf", "SingularBasis", "semm", "serep_expansion", "singular_basis"),
        "reduction": (
            "Reduction",
            "craig_bampton",
            "dual_craig_bampton",
            "dynamic",
            "guyan",
            "irs",
            "macneal",
            "projected",
            "rubin",
            "serep",
        ),
        "transfer_paths": (
            "SourceForces",
            "Spectra",
            "path_contributions",
            "source_forces",
            "transmissibility",
        ),
        "virtual_point": ("Channel", "Transformed", "VirtualPoint", "transform"),
    }
    """Loaded when one is asked for: most programs need none of them."""

    def __getattr__(name: str) -> Any:
        if name == "__version__":
            from importlib.metadata import version  # takes its time to load

            return version("drivetrain-crosscheck")
        for module, names in LAZY.items():
            if name in names:
                from importlib import import_module

                return getattr(import_module(f".{module}", __name__), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
