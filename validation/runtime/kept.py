"""Finished pieces of a command on disk, each bound to what made it and to its place.

A piece is used again only if its SHA-256, over what made it, its key and its contents, is the one
written before them; it is on the disk in full before it counts. What does not fit (swapped, cut,
flipped, another version's, anybody's) is never looked into.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fbs.files.whole_files import written_whole
from mbs_models.integration.fingerprint import code_digest

from .executors import versions
from .output_folder import make_directory, telling

PIECE = re.compile(r"[A-Za-z0-9]+\.piece|\.[0-9a-f]{16}\.partial")  # the second: a killed process'
DIGEST_BYTES = 32
PACKAGES = ("fbs", "mbs_models", "validation")


class KeptPieces:
    """Arrays by key, as files in a directory of their own.

    Parameters
    ----------
    directory
        Where they are; made with the first.
    made_by
        What is computed, as text. The versions of libraries and our own code count besides.
    """

    def __init__(self, directory: Path, made_by: str) -> None:
        self.directory = directory
        made = repr((made_by, versions(), code_digest(*PACKAGES)))
        self._made = hashlib.sha256(made.encode()).digest()
        self.unfit: list[str] = []  # keys of pieces that were there and could not be used

    def load(self, key: str) -> dict[str, NDArray[Any]] | None:
        """The arrays of a piece; None if it is not there, or does not fit."""
        path = self._path(key)
        if not os.path.lexists(path):
            return None
        try:
            content = path.read_bytes() if path.is_file() and not path.is_symlink() else b""
        except OSError:
            content = b""
        digest, arrays = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        if digest != self._digest(key, arrays):
            self.refuse(key)
            return None
        with np.load(io.BytesIO(arrays), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}

    def refuse(self, key: str) -> None:
        """Count a piece among those that could not be used."""
        self.unfit.append(key)

    def save(self, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep a piece, whole or not at all."""
        make_directory(self.directory)
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, **arrays)
        path = self._path(key)
        with telling(path), written_whole(path) as file:
            file.write(self._digest(key, content.getvalue()))
            file.write(content.getvalue())
            file.flush()
            os.fsync(file.fileno())

    def clear(self) -> None:
        """Forget all pieces, and touch nothing else there."""
        if not self.directory.exists():
            return
        with telling(self.directory):
            for path in list(self.directory.iterdir()):
                if PIECE.fullmatch(path.name):
                    path.unlink()
            if not any(self.directory.iterdir()):
                self.directory.rmdir()

    def _digest(self, key: str, content: bytes) -> bytes:
        return hashlib.sha256(self._made + key.encode() + b"\0" + content).digest()

    def _path(self, key: str) -> Path:
        return self.directory / f"{key}.piece"
