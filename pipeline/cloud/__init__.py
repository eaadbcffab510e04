"""Point clouds: reading and writing them, and cleaning them into the points of one tree."""

from __future__ import annotations

from pipeline.cloud.clean import CleanOptions, clean
from pipeline.cloud.read import CLOUD_SUFFIXES, read_cloud
from pipeline.cloud.write import write_cloud

__all__ = ["CLOUD_SUFFIXES", "CleanOptions", "clean", "read_cloud", "write_cloud"]
