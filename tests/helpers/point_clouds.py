"""Point clouds as publishers send them: dicts with the fields of a message."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Type codes of PointField by numpy type.
DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def point_cloud2(
    columns: Mapping[str, Any],
    *,
    height: int = 1,
    point_step: int = 0,
    row_padding: int = 0,
    big_endian: bool = False,
    offsets: Mapping[str, int] | None = None,
) -> dict[str, Any]:
    """Return a PointCloud2 with a field for each array, in the array's own type.

    Args:
        columns: One array per field; their length is width x height.
        height: Number of rows.
        point_step: Bytes of a point; 0 for the least.
        row_padding: Bytes after each row.
        big_endian: Whether values are big-endian.
        offsets: Offsets of fields that do not follow the one before.
    """
    arrays = {name: np.asarray(value) for name, value in columns.items()}
    end, fields, places = 0, [], {}
    for name, array in arrays.items():
        places[name] = start = (offsets or {}).get(name, end)
        count = 1 if array.ndim == 1 else array.shape[1]
        code = DATATYPES[array.dtype.str[1:]]
        fields.append({"name": name, "offset": start, "datatype": code, "count": count})
        end = start + array.itemsize * count
    step = point_step or end
    number = len(next(iter(arrays.values())))
    width = number // height
    rows = np.full((height, width * step + row_padding), 0xEE, np.uint8)
    points = rows[:, : width * step].reshape(height, width, step)
    for name, array in arrays.items():
        values = array.astype(array.dtype.newbyteorder(">" if big_endian else "<"))
        size = values[0].nbytes
        bytes_of = np.ascontiguousarray(values).view(np.uint8).reshape(height, width, size)
        points[:, :, places[name] : places[name] + size] = bytes_of
    return {
        "header": {"frame_id": "lidar"},
        "height": height,
        "width": width,
        "fields": fields,
        "is_bigendian": big_endian,
        "point_step": step,
        "row_step": rows.shape[1],
        "data": _padded(rows, points, width * step).tobytes(),
        "is_dense": False,
    }


def _padded(rows: np.ndarray, points: np.ndarray, size: int) -> np.ndarray:
    # The reshape above copied if rows are padded.
    rows[:, :size] = points.reshape(len(rows), size)
    return rows


def random_points(count: int, seed: int = 1, size: float = 10.0) -> dict[str, np.ndarray]:
    """Return x, y and z (float32) within +-size metres."""
    values = np.random.default_rng(seed).uniform(-size, size, (3, count)).astype(np.float32)
    return dict(zip("xyz", values, strict=True))


def packed_color(red: int, green: int, blue: int, alpha: int = 0) -> int:
    """Return a colour as in the fields rgb and rgba."""
    return alpha << 24 | red << 16 | green << 8 | blue
