"""Pictures of a cloud and its model."""

from pipeline.view.options import PictureOptions

__all__ = ["PictureOptions"]
