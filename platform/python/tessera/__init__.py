# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
"""Dense semantic occupancy maps that teams of robots build and share: numpy in, numpy out.

Lengths are metres. T_a_b takes coordinates of frame b to frame a. Anything may be called from any thread: work is done
without the GIL, and calls on one object wait for each other if they must. An invalid argument or file raises InputError,
an array of the wrong type TypeError; work that cannot be completed raises Error.
"""
import enum

from . import _tessera
from ._refusals import shorten as _shorten

_shorten(_tessera)

from ._tessera import Alignment as Alignment
from ._tessera import ClassTable as ClassTable
from ._tessera import Clouds as Clouds
from ._tessera import Dataset as Dataset
from ._tessera import Error as Error
from ._tessera import Estimates as Estimates
from ._tessera import Evaluation as Evaluation
from ._tessera import FusedMap as FusedMap
from ._tessera import InputError as InputError
from ._tessera import LocalMap as LocalMap
from ._tessera import Map as Map
from ._tessera import Nearest as Nearest
from ._tessera import Rays as Rays
from ._tessera import Scan as Scan
from ._tessera import ScanReport as ScanReport
from ._tessera import Session as Session
from ._tessera import Sharer as Sharer
from ._tessera import Voxels as Voxels
from ._tessera import __version__ as __version__
from ._tessera import align as align
from ._tessera import fuse as fuse
from ._tessera import load as load
from ._tessera import read_cloud as read_cloud
from ._tessera import read_transform as read_transform


class State(enum.IntEnum):
    """The state of a voxel: the values of Estimates.state."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


class RayEnd(enum.IntEnum):
    """How a ray ended: the values of Rays.end."""

    MAX_RANGE = 0
    OCCUPIED = 1
    UNKNOWN = 2
    INVALID = 3


__all__ = [
    "Alignment", "ClassTable", "Clouds", "Dataset", "Error", "Estimates", "Evaluation", "FusedMap", "InputError",
    "LocalMap", "Map", "Nearest", "RayEnd", "Rays", "Scan", "ScanReport", "Session", "Sharer", "State", "Voxels",
    "__version__", "align", "fuse", "load", "read_cloud", "read_transform"]
