"""An image as those see it that need no camera."""

from __future__ import annotations

from dataclasses import dataclass

from covista_service.perception.camera import Features, View


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """Features as detected, and the size of the image in pixels."""

    features: Features
    width: int
    height: int

    @property
    def larger_side_px(self) -> int:
        """The longer of its two sides."""
        return max(self.width, self.height)


def image_of(view: View) -> Image:
    """A view without its camera and pose."""
    return Image(view.features, view.camera.width, view.camera.height)
