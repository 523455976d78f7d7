"""The scaling of joints by which a kernel B Y B^T + 1/Z is judged and inverted."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .checks import ComplexArray, FloatArray


def joint_scaling(
    moduli: FloatArray, stiffness: Mapping[int, ComplexArray]
) -> tuple[FloatArray, dict[int, ComplexArray]]:
    """Return s, s^-2 = e + 1/|Z|, and s^2 / Z of the flexible joints, of modulus one at most.

    s (B Y B^T + 1/Z) s has entries of order one, so that joints of any stiffness are judged alike,
    and a joint with Z = 0 (a damper at 0 Hz) drops out, s = 0, without a division by zero.

    Parameters
    ----------
    moduli : array, shape (n_joint, nf)
        e, the moduli of both ends' receptances, added up.
    stiffness : mapping of int to array, shape (nf,)
        Z = k + jwc of each flexible joint, by its number; the others are rigid, 1/Z = 0.
    """
    e = np.maximum(moduli, np.finfo(float).tiny)
    scale, own = 1 / np.sqrt(e), {}
    for joint, z in stiffness.items():
        modulus = np.abs(z)
        total = 1 + modulus * e[joint]
        scale[joint] = np.sqrt(modulus / total)
        phase = np.divide(modulus, z, out=np.ones_like(z), where=modulus > 0)
        own[joint] = phase / total
    return scale, own
