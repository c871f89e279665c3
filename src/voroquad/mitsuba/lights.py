"""Light at the first hit of a camera ray: that of one emitter sample and that of one BSDF sample, either of which the
sets may draw, separate from all other light."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
from mitsuba.python.ad.integrators.common import ADIntegrator

from .domains import CameraSample
from .tracing import name_of


@dataclass
class CameraLight:
    """Light along camera rays.

    Attributes
    ----------
    emitted : mitsuba.Spectrum
        Of emitters that the ray meets.
    light : mitsuba.Spectrum
        By the emitter sample at the first hit.
    direction : mitsuba.Spectrum
        By the BSDF sample at the first hit: of emitters in its direction, and what is reflected twice or more.
    valid : mitsuba.Bool
        Did the ray hit something?
    """

    emitted: Any
    light: Any
    direction: Any
    valid: Any


class FirstHit:
    """Traces camera rays as a nested integrator does, with a given emitter sample or BSDF sample at the first hit.

    Parameters
    ----------
    nested : mitsuba.Integrator
        ``path``, ``direct`` with one emitter sample, or ``prb``.
    domain : str
        Which sample is given: ``light`` or ``direction``.

    Raises
    ------
    ValueError
        Another integrator, or one that takes no such samples, or several.

    Notes
    -----
    With multiple importance sampling (balance of the two densities' squares, as Mitsuba's path tracers have it), the
    light reflected at the first hit is

        f(ω_e) L_e(ω_e) cos θ_e m_e / p_e  +  f(ω_b) cos θ_b / p_b · ( m_b L_e(ω_b) + L_i(ω_b) ) ,

    with ω_e the emitter sample, ω_b the BSDF sample, m the weights of the two, L_e what emitters send and L_i what
    surfaces reflect. The first term is a function of the emitter sample alone, and the second one of the BSDF sample
    and what comes after it. L_i is what the nested integrator,
    one bounce shorter, finds along ω_b, less the emission that it meets first; here the loop of `_onward` finds it, as
    Mitsuba's path tracers do, from the BSDF sample that is traced already.
    """

    def __init__(self, nested: mi.Integrator, domain: str = "light") -> None:
        settings = _settings(nested, domain)
        self._helper = nested
        self.hides_emitters = bool(nested.hide_emitters)
        # In alpha: what the path tracer counts as hit, and the others do not
        self._sees_environment = nested.class_name() == "PathIntegrator" and not self.hides_emitters
        self.samples_bsdf = settings.get("bsdf_samples", 1) > 0
        depth = settings.get("max_depth", 2)
        emitter_samples = settings.get("emitter_samples", 1)
        self.samples_emitters = emitter_samples > 0
        few = emitter_samples <= 1 and settings.get("bsdf_samples", 0) <= 1 and depth >= 2
        if not few or not {"light": self.samples_emitters, "direction": self.samples_bsdf}[domain]:
            needed, other = {"light": ("emitter", "BSDF"), "direction": ("BSDF", "emitter")}[domain]
            raise ValueError(
                f"domain {domain!r} needs a nested integrator that takes one {needed} sample and at most one {other} "
                f"sample, got {' '.join(str(nested).split())}; take more samples per pixel instead, or a greater "
                "max_depth"
            )
        self.depth, self.rr_depth = depth, settings.get("rr_depth", depth)

    def trace(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: Any, drawn: CameraSample, active: mi.Bool
    ) -> CameraLight:
        """Light along camera rays, with the samples at their first hits that are drawn; the sampler draws the others.

        In the order in which Mitsuba's path tracers draw them.
        """
        context = mi.BSDFContext()
        hit = self._first_hit(scene, ray, active)
        bsdf = hit.bsdf(ray)
        emission = hit.emitter(scene).eval(hit, active & (hit.is_valid() | (not self.hides_emitters)))
        reflects = active & hit.is_valid()

        # The emitter sample
        lit = reflects & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth) & self.samples_emitters
        u = sampler.next_2d() if drawn.light is None else drawn.light
        direction, radiance = scene.sample_emitter_direction(hit, u, True, lit)
        lit &= direction.pdf != 0
        outgoing = hit.to_local(direction.d)
        valid = active & (hit.is_valid() | (self._sees_environment and scene.environment() is not None))
        if not self.samples_bsdf:
            value = _in_world(hit, bsdf.eval(context, hit, outgoing, lit), outgoing)
            return CameraLight(emission, dr.select(lit, value * radiance, 0), mi.Spectrum(0), valid)

        # The BSDF sample, and what emits where it leads
        lobe = sampler.next_1d() if drawn.lobe is None else drawn.lobe
        v = sampler.next_2d() if drawn.direction is None else drawn.direction
        value, pdf, found, weight = bsdf.eval_pdf_sample(context, hit, outgoing, lobe, v, reflects)
        value, weight = _in_world(hit, value, outgoing), _in_world(hit, weight, found.wo)
        share = dr.select(direction.delta, 1, _share(direction.pdf, pdf))
        sampled = dr.select(lit, value * radiance * share, 0)
        on = reflects & dr.any(mi.unpolarized_spectrum(weight) != 0)
        onward = hit.spawn_ray(hit.to_world(found.wo))
        onward.wavelengths = ray.wavelengths
        sampler.next_1d()  # for the roulette that path tracers play here too: what follows is what they would draw
        reflected = self._onward(scene, sampler, onward, hit, found, weight, on)
        return CameraLight(emission, sampled, reflected, valid)

    @dr.syntax  # type: ignore[untyped-decorator]
    def _onward(
        self, scene: mi.Scene, sampler: mi.Sampler, onward: Any, hit: Any, found: Any, weight: Any, on: mi.Bool
    ) -> Any:
        """Light by the BSDF sample of the first hit: what emits where it leads, and what is reflected from there on."""
        light = mi.Spectrum(0)
        ray, active = mi.Ray3f(onward), mi.Bool(on)
        throughput, eta = mi.Spectrum(weight), mi.Float(found.eta)
        before, pdf = mi.SurfaceInteraction3f(hit), mi.Float(found.pdf)
        smooth = ~mi.has_flag(found.sampled_type, mi.BSDFFlags.Delta)
        edges = mi.UInt32(2)  # from the camera to where the ray leads
        while active:
            here = scene.ray_intersect(ray, active)
            by_emitters = scene.pdf_emitter_direction(
                before, mi.DirectionSample3f(scene, here, before), active & smooth & self.samples_emitters
            )
            share = dr.select(smooth & self.samples_emitters, _share(pdf, by_emitters), 1)
            light += dr.select(active, throughput * share * here.emitter(scene).eval(here, active), 0)
            active &= here.is_valid() & (edges < self.depth)

            context = mi.BSDFContext()
            bsdf = here.bsdf(ray)
            lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            direction, radiance = scene.sample_emitter_direction(here, sampler.next_2d(), True, lit)
            lit &= direction.pdf != 0
            outgoing = here.to_local(direction.d)
            value, pdf, sample, weight = bsdf.eval_pdf_sample(
                context, here, outgoing, sampler.next_1d(), sampler.next_2d(), active
            )
            value, weight = _in_world(here, value, outgoing), _in_world(here, weight, sample.wo)
            share = dr.select(direction.delta, 1, _share(direction.pdf, pdf))
            light += dr.select(lit, throughput * value * radiance * share, 0)
            ray = here.spawn_ray(here.to_world(sample.wo))
            throughput = throughput * weight
            eta *= sample.eta
            before, pdf = here, sample.pdf
            smooth = ~mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)

            # Russian roulette
            largest = dr.max(mi.unpolarized_spectrum(throughput))
            survival = dr.minimum(largest * dr.square(eta), 0.95)
            plays = edges >= self.rr_depth
            throughput = dr.select(plays, throughput * dr.rcp(dr.detach(survival)), throughput)
            active &= (largest != 0) & (~plays | (sampler.next_1d() < survival))
            edges += 1
        return light

    def _first_hit(self, scene: mi.Scene, ray: Any, active: mi.Bool) -> Any:
        """Where camera rays arrive; past area emitters, if those are hidden."""
        hit = scene.ray_intersect_preliminary(ray, coherent=True, active=active)
        if self.hides_emitters:
            emits = active & hit.is_valid() & (hit.shape.emitter() != None)  # noqa: E711  (an array of pointers)
            from_there = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal, emits).spawn_ray(ray.d)
            hit[emits] = self._helper.skip_area_emitters(scene, from_there, True, emits)
        return hit.compute_surface_interaction(ray, mi.RayFlags.All, active)


def _in_world(hit: Any, value: mi.Spectrum, outgoing: mi.Vector3f) -> mi.Spectrum:
    """A value of a BSDF for light from a local direction; polarized, in the frames of the rays in the world."""
    return hit.to_world_mueller(value, -outgoing, hit.wi) if mi.is_polarized else value


def _share(p: mi.Float, q: mi.Float) -> mi.Float:
    """Weight of a sample of density p where another of density q could have found the same (power heuristic)."""
    p, q = p * p, q * q
    share = p / (p + q)
    return dr.detach(dr.select(dr.isfinite(share), share, 0))


def _settings(nested: mi.Integrator, domain: str) -> dict[str, int]:
    """The numbers that an integrator was made with: Mitsuba shows those of its C++ ones in their description only."""
    name = name_of(nested)
    if isinstance(nested, ADIntegrator) and name == "PRBIntegrator":
        if mi.is_polarized:
            raise ValueError(
                f"domain {domain!r} cannot wrap 'prb' in {mi.variant()}, where it renders another image; nest 'path'"
            )
        return {"max_depth": nested.max_depth, "rr_depth": nested.rr_depth}
    if name not in ("PathIntegrator", "DirectIntegrator"):
        raise ValueError(
            f"domain {domain!r} cannot wrap {name}: its samples at the first hit cannot be distinguished from others; "
            "nest 'path', 'direct' or 'prb'"
        )
    return {key: int(number) for key, number in re.findall(r"(\w+) = (\d+)", str(nested))}
