"""The sensor plug-in ``moving``: a camera whose pose changes while the shutter is open."""

from __future__ import annotations

from typing import Any

import mitsuba as mi

from .motion import TransformTrack, keyframes


class Moving(mi.Sensor):
    """A camera that moves through keyframes (``moving``).

    .. pluginparameters::

     * - (nested plug-in)
       - :paramtype:`sensor`
       - The camera that moves: a ``perspective``, ``thinlens``, ``orthographic`` or other sensor of Mitsuba's, with
         its film, sampler and open shutter.
     * - to_world@TIME
       - |transform|
       - Pose at a time: rotation and translation, applied after the camera's own ``to_world``. Give two or more;
         between them the translation goes linearly and the rotation by slerp. TIME is in the units of
         ``shutter_open`` and ``shutter_close``, a decimal or a fraction such as ``1/2`` (`mitsuba.load_dict` allows no
         points); before the first and after the last pose the camera rests.

    Notes
    -----
    Each ray has the pose of its own time, which the sampler draws or the sets of ``reweighted`` with domain ``time``.

    Examples
    --------
    >>> import mitsuba as mi, voroquad.mitsuba
    >>> mi.set_variant("llvm_ad_rgb")
    >>> camera = {"type": "perspective", "shutter_open": 0.0, "shutter_close": 1.0}
    >>> moved = mi.ScalarTransform4f().translate([0.5, 0, 0])
    >>> sensor = mi.load_dict({"type": "moving", "camera": camera, "to_world@0": mi.ScalarTransform4f(),
    ...                        "to_world@1": moved})
    >>> float(sensor.shutter_open_time())
    1.0
    """

    def __init__(self, props: mi.Properties) -> None:
        nested = [value for _, value in props.objects()]
        if len(nested) != 1 or not isinstance(nested[0], mi.Sensor):
            raise ValueError(
                f"'moving' needs one nested sensor, which holds film, sampler and shutter, got {len(nested)} objects"
            )
        self.camera = nested[0]
        # One film, one sampler, one shutter for both
        props["film"], props["sampler"] = self.camera.film(), self.camera.sampler()
        props["shutter_open"] = self.camera.shutter_open()
        props["shutter_close"] = self.camera.shutter_open() + self.camera.shutter_open_time()
        super().__init__(props)

        tracks = keyframes(props)
        track = tracks.pop("to_world", None)
        if not isinstance(track, TransformTrack) or len(track.times) < 2 or tracks:
            raise ValueError("'moving' needs two or more poses, transforms named to_world@0, to_world@1 and alike")
        if not track.rigid:
            raise ValueError("to_world@…: a camera's pose must not scale; leave rotation and translation only")
        self.track = track
        self.m_needs_sample_2 = self.camera.needs_sample_2()
        self.m_needs_sample_3 = self.camera.needs_sample_3()

    def sample_ray(
        self, time: mi.Float, sample1: mi.Float, sample2: mi.Point2f, sample3: mi.Point2f, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Spectrum]:
        """A ray of the camera, where the camera is at that time."""
        ray, weight = self.camera.sample_ray(time, sample1, sample2, sample3, active)
        rotation, shift = self.track.pose(time)
        ray.o, ray.d = rotation @ ray.o + shift, rotation @ ray.d
        return ray, weight

    def sample_ray_differential(
        self, time: mi.Float, sample1: mi.Float, sample2: mi.Point2f, sample3: mi.Point2f, active: Any = True
    ) -> tuple[mi.RayDifferential3f, mi.Spectrum]:
        """A ray of the camera with those of the neighbouring pixels, where the camera is at that time."""
        ray, weight = self.camera.sample_ray_differential(time, sample1, sample2, sample3, active)
        rotation, shift = self.track.pose(time)
        ray.o, ray.d = rotation @ ray.o + shift, rotation @ ray.d
        if ray.has_differentials:
            ray.o_x, ray.d_x = rotation @ ray.o_x + shift, rotation @ ray.d_x
            ray.o_y, ray.d_y = rotation @ ray.o_y + shift, rotation @ ray.d_y
        return ray, weight

    def traverse(self, callback: mi.TraversalCallback) -> None:
        """Show the camera's parameters as ``camera.…``."""
        super().traverse(callback)
        callback.put("camera", self.camera, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: list[str] | None = None) -> None:
        """Tell the camera too: it shares the film."""
        super().parameters_changed(keys or [])
        self.camera.parameters_changed(keys or [])

    def to_string(self) -> str:
        return f"Moving[times = {self.track.times.tolist()}, camera = {self.camera}]"


mi.register_sensor("moving", Moving)
