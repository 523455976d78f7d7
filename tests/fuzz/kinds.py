"""What is tried: an input of each kind, in a folder of its own."""

from __future__ import annotations

from collections.abc import Mapping

from .calls import library
from .disks import folders, pieces
from .files import force_files, frf_files, hdf5_files, record_files
from .models import model_files, model_numbers, names
from .trial import Trial
from .words import excitation_words, options, sweep_words

KINDS: Mapping[str, tuple[Trial, int]] = {
    "model files, changed": (model_files, 30),
    "numbers of model files": (model_numbers, 20),
    "FRF files": (frf_files, 12),
    "FRF files of MATLAB 7.3": (hdf5_files, 1),
    "record files": (record_files, 10),
    "force files": (force_files, 3),
    "words of sweeps": (sweep_words, 6),
    "words of excitations": (excitation_words, 10),
    "options": (options, 10),
    "names": (names, 4),
    "folders": (folders, 3),
    "pieces on disk": (pieces, 5),
    "library calls": (library, 15),
}  # and how many of a hundred and some
