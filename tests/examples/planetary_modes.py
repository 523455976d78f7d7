"""Natural frequencies of a planetary stage: det(K − ω²M) = 0 of exudyn's linearised bodies."""

from mbs_models import Kind, drivetrain_modes, load

stage = load("lin-parker-4")  # sun, ring, carrier and four planets (Lin & Parker 1999)
modes = drivetrain_modes(stage)

by_kind = {kind: [m.frequency_hz for m in modes.modes if m.kind == kind] for kind in Kind}
for kind, frequencies in by_kind.items():
    print(f"{kind:>14}:", ", ".join(f"{f:.1f}" for f in frequencies))
