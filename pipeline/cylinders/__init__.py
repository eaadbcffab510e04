"""Levenberg-Marquardt cylinders along the branches, their taper, and the breast-height diameter."""

from pipeline.cylinders.fit import CylinderOptions, fit

__all__ = ["CylinderOptions", "fit"]
