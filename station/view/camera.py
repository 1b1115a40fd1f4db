"""The camera: its image, the corners found in it, the reference corners, and where the camera is in the scene."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
import rerun as rr

from shared import frames
from shared.foxglove import CameraCalibration, CompressedImage
from shared.geometry import Array, quaternion_from_matrix
from shared.messages import CameraGeometry, MarkerCorners, RunEvent, Sample
from shared.pictures import size_px
from station.view import colours, entities
from station.view.canvas import Canvas, Cap
from station.view.part import Handler, Rates
from station.view.reference import ReferenceTracker
from station.view.setup import Setup

_RECENT = 90
_IMAGE_STALE_NS = 500_000_000
_SAME_FRAME_NS = 3_000_000


class CameraPart:
    """Draws below `entities.CAMERA`; pixels are moved by half a pixel from OpenCV's convention to Rerun's."""

    def __init__(self, canvas: Canvas, setup: Setup, rates: Rates) -> None:
        self._canvas = canvas
        self._resolution = setup.image_px
        self._images = Cap(rates.image_hz)
        self._drawings = {name: Cap(rates.drawing_hz) for name in (entities.CORNERS, entities.PLATE_MARK)}
        self._recent: deque[MarkerCorners] = deque(maxlen=_RECENT)
        self._shown_ns: int | None = None
        self._waiting_ns: int | None = None
        self._reference = ReferenceTracker()
        self._shown_reference: Array | None = None
        self._intrinsics: Array | None = None
        self._geometry: CameraGeometry | None = None
        self._placed: tuple[object, ...] = ()
        _describe_looks(canvas)

    def handlers(self) -> Mapping[str, Handler]:
        """Returns the handlers of image, corners, calibration and the session's phases and samples."""
        return {
            "camera/image": self._on_image,
            "camera/corners": self._on_corners,
            "camera/plate": self._on_plate,
            "camera/calibration": self._on_calibration,
            "camera/geometry": self._on_geometry,
            "session/event": self._on_event,
            "session/sample": self._on_sample,
        }

    def _on_image(self, image: CompressedImage) -> None:
        if size_px(image.data) is None or not self._images.due(self._canvas.now_ns):
            return  # the viewer would unpack whatever else it knows, of any size
        media_type = f"image/{image.format.replace('jpg', 'jpeg')}"
        self._canvas.log(entities.IMAGE, rr.EncodedImage(contents=image.data, media_type=media_type))
        self._shown_ns, self._waiting_ns = self._canvas.now_ns, image.timestamp.ns
        for corners in self._recent:
            self._draw_with_image(corners)

    def _on_corners(self, corners: MarkerCorners) -> None:
        self._reference.on_corners(corners)
        self._recent.append(corners)
        if self._shown_ns is not None and self._canvas.now_ns - self._shown_ns < _IMAGE_STALE_NS:
            self._draw_with_image(corners)
        elif self._drawings[entities.CORNERS].due(self._canvas.now_ns):
            self._draw(corners)

    def _draw_with_image(self, corners: MarkerCorners) -> None:
        """Draws the corners of the image's own frame, at its time: others would look like a bad tracker.

        Both carry the camera's own clock; the image's time on the station's clock is the one that it was shown at.
        """
        if self._waiting_ns is None or self._shown_ns is None:
            return
        if abs(corners.capture_ns - self._waiting_ns) < _SAME_FRAME_NS:
            self._waiting_ns = None
            self._canvas.at(self._shown_ns)
            self._draw(corners)

    def _draw(self, corners: MarkerCorners) -> None:
        seen = np.reshape(corners.corners_px, (4, 2)) if corners.found else None
        self._outline(entities.CORNERS, seen)
        self._points(seen)
        self._show_reference()
        self._show_way(seen)

    def _on_plate(self, corners: MarkerCorners) -> None:
        if self._drawings[entities.PLATE_MARK].due(self._canvas.now_ns):
            seen = np.reshape(corners.corners_px, (4, 2)) if corners.found else None
            self._outline(entities.PLATE_MARK, seen)

    def _on_event(self, event: RunEvent) -> None:
        self._reference.on_event(event)
        self._show_reference()

    def _on_sample(self, sample: Sample) -> None:
        self._reference.on_sample(sample)
        self._show_reference()

    def _on_calibration(self, calibration: CameraCalibration) -> None:
        if len(calibration.K) == 9:
            self._intrinsics = np.reshape(np.array(calibration.K), (3, 3))
            self._resolution = (calibration.width, calibration.height)
            self._place()

    def _on_geometry(self, geometry: CameraGeometry) -> None:
        self._geometry = geometry.if_calibrated()
        self._place()

    def _place(self) -> None:
        """Puts the camera into the scene when what is known of it has changed."""
        if self._geometry is None or not self._geometry.camera_height_m:
            return
        k = frames.pinhole_of(self._geometry) if self._intrinsics is None else self._intrinsics
        known = (self._geometry.plate_from_pixel, self._resolution, *k.ravel().tolist())
        if known == self._placed:
            return
        self._placed = known
        rotation, place = frames.camera_pose(self._geometry, K=k)
        w, x, y, z = quaternion_from_matrix(rotation)
        self._canvas.log(
            entities.CAMERA,
            rr.Transform3D(translation=place, quaternion=rr.Quaternion(xyzw=[x, y, z, w])),
            rr.Pinhole(image_from_camera=k, resolution=self._resolution, image_plane_distance=0.06),
        )

    def _outline(self, path: str, corners_px: Array | None) -> None:
        strips = [] if corners_px is None else [np.vstack([corners_px, corners_px[:1]]) + frames.PIXEL_CENTRE]
        self._canvas.log(path, rr.LineStrips2D.from_fields(strips=strips))

    def _points(self, corners_px: Array | None) -> None:
        points = np.empty((0, 2)) if corners_px is None else corners_px + frames.PIXEL_CENTRE
        self._canvas.log(entities.CORNERS, rr.Points2D.from_fields(positions=points))

    def _show_reference(self) -> None:
        reference = self._reference.corners_px
        if reference is not self._shown_reference:
            self._shown_reference = reference
            self._outline(entities.REFERENCE, reference)

    def _show_way(self, seen: Array | None) -> None:
        """Draws arrows from the reference corners to where they are now."""
        reference = self._reference.corners_px
        way = np.empty((0, 2)) if seen is None or reference is None else seen - reference
        start = np.empty((0, 2)) if reference is None else reference + frames.PIXEL_CENTRE
        self._canvas.log(entities.WAY, rr.Arrows2D.from_fields(vectors=way, origins=start[: len(way)]))


def _describe_looks(canvas: Canvas) -> None:
    """Describes colours and widths."""
    for path, colour in (
        (entities.CORNERS, colours.MARK),
        (entities.PLATE_MARK, colours.PLATE),
        (entities.REFERENCE, colours.REFERENCE),
    ):
        canvas.look(path, rr.LineStrips2D.from_fields(colors=[colour], radii=[colours.LINE]))
    points = rr.Points2D.from_fields(colors=colours.CORNERS, radii=[colours.DOT], draw_order=40.0)
    canvas.look(entities.CORNERS, points)
    canvas.look(entities.WAY, rr.Arrows2D.from_fields(colors=colours.CORNERS, radii=[colours.LINE]))
