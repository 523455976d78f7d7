"""FRFs to and from xarray and pandas, which are imported when asked for (the extra `files`).

An `xarray.DataArray` has the dimensions frequency (Hz), response and excitation, and the quantity
and its unit as attributes; a `pandas.DataFrame` one row a line and one column (response,
excitation) an FRF.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FbsError
from ..frf import Frf, as_quantity

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import DataArray

DIMENSIONS = ("frequency", "response", "excitation")


def to_xarray(frf: Frf) -> DataArray:
    """Return an FRF as a DataArray; the values are not copied."""
    from xarray import DataArray

    return DataArray(
        frf.values,
        coords={
            "frequency": ("frequency", frf.frequency, {"units": "Hz"}),
            "response": list(frf.responses),
            "excitation": list(frf.excitations),
        },
        dims=DIMENSIONS,
        name=str(frf.quantity),
        attrs={"quantity": str(frf.quantity), "units": frf.quantity.unit},
    )


def from_xarray(array: DataArray, quantity: str | None = None) -> Frf:
    """Return the FRF of a DataArray; dimensions may be in any order.

    Parameters
    ----------
    array : DataArray
    quantity : str, optional
        Where the array has no attribute of this name.

    Raises
    ------
    FbsError
        Other dimensions, or no quantity.
    """
    if set(array.dims) != set(DIMENSIONS):
        raise FbsError(
            f"the array has the dimensions {', '.join(map(str, array.dims))}; needed are "
            f"{', '.join(DIMENSIONS)}"
        )
    ordered = array.transpose(*DIMENSIONS)
    return Frf(
        ordered["frequency"].values,
        ordered.values,
        tuple(map(str, ordered["response"].values)),
        tuple(map(str, ordered["excitation"].values)),
        as_quantity(_stated(quantity, array.attrs)),
    )


def to_pandas(frf: Frf) -> DataFrame:
    """Return FRFs as a DataFrame: lines as rows, (response, excitation) as columns."""
    from pandas import DataFrame, Index, MultiIndex

    pairs = [(response, excitation) for response, excitation, _ in frf.curves()]
    frame = DataFrame(
        frf.values.reshape(frf.frequency.size, -1),
        index=Index(frf.frequency, name="frequency"),
        columns=MultiIndex.from_tuples(pairs, names=DIMENSIONS[1:]),
    )
    frame.attrs |= {"quantity": str(frf.quantity), "units": frf.quantity.unit}
    return frame


def from_pandas(frame: DataFrame, quantity: str | None = None) -> Frf:
    """Return the FRF of a DataFrame whose columns are (response, excitation).

    Parameters
    ----------
    frame : DataFrame
    quantity : str, optional
        Where the frame has no attribute of this name.

    Raises
    ------
    FbsError
        Columns of other depth, a pair that is missing, or no quantity.
    """
    if frame.columns.nlevels != 2:
        raise FbsError(
            f"the columns have {frame.columns.nlevels} levels; needed are response and excitation"
        )
    pairs = [(str(response), str(excitation)) for response, excitation in frame.columns]
    rows, columns = (tuple(dict.fromkeys(labels)) for labels in zip(*pairs, strict=True))
    if len(set(pairs)) != len(pairs) or len(pairs) != len(rows) * len(columns):
        raise FbsError(
            f"the {len(pairs)} columns are no matrix of {len(rows)} responses and {len(columns)} "
            "excitations"
        )
    order = [pairs.index((r, e)) for r in rows for e in columns]
    values = frame.to_numpy(dtype=complex)[:, order].reshape(-1, len(rows), len(columns))
    named = as_quantity(_stated(quantity, frame.attrs))
    return Frf(np.asarray(frame.index, dtype=float), values, rows, columns, named)


def _stated(quantity: str | None, attributes: dict[Any, Any]) -> str:
    stated = quantity or attributes.get("quantity")
    if not stated:
        raise FbsError("the quantity is not stated: receptance, mobility or accelerance")
    return str(stated)
