"""Makes the scene depth-of-field: its XML file and its meshes.

    python scenes/depth_of_field.py

A trefoil knot stands in focus on a tiled floor, a row of spheres runs from near the lens into the distance, and
metal beads behind catch the sun. There is one light, a directional sun: it needs no samples. The sky's fill light
(ambient occlusion under a soft sky, integrated here with a fixed set of directions) is stored per vertex and
emitted by the surfaces, with a sampling weight of 0, so that it needs none either. With the integrator
``direct`` (one emitter sample, no BSDF sample) a ray's radiance is a function of the ray alone: what noise an
image has comes from the lens and the pixel.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree as xml

import mitsuba as mi
import numpy as np
from common import PACKAGE, add
from numpy.typing import NDArray

DESTINATION = PACKAGE / "depth-of-field"

Array = NDArray[np.float64]

SUN = np.array([0.62, -0.72, 0.30])  # direction of flight
EYE, TARGET = np.array([0.0, 2.05, 7.6]), np.array([0.1, 0.78, 0.0])
FOCUS = np.array([0.25, 1.0, 0.55])  # front of the knot
ZENITH, HORIZON = np.array([0.25, 0.50, 1.0]), np.array([1.0, 0.86, 0.70])
SKY = 0.62  # radiance of the fill
OCCLUSION_DIRECTIONS = 256
METALS = (np.array([0.95, 0.72, 0.32]), np.array([0.90, 0.90, 0.92]), np.array([0.95, 0.55, 0.42]))


@dataclass
class Mesh:
    """A triangle mesh of one material."""

    name: str
    vertices: Array
    faces: NDArray[np.int64]
    colour: Array
    normals: Array
    roughness: float | None = None  # None: diffuse
    smooth: bool = True


@dataclass
class Ball:
    """A sphere of one material."""

    centre: Array
    radius: float
    colour: Array
    metal: bool = False


# ---------------------------------------------------------------------- surfaces


def grid_faces(rows: int, columns: int, *, wrap_rows: bool = True, wrap_columns: bool = True) -> NDArray[np.int64]:
    """Triangles of a rows × columns grid of vertices, closed along the wrapped axes."""
    i, j = np.meshgrid(np.arange(rows - (not wrap_rows)), np.arange(columns - (not wrap_columns)), indexing="ij")
    a, b = i * columns + j, (i + 1) % rows * columns + j
    c, d = (i + 1) % rows * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    return np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], -2).reshape(-1, 3)


def vertex_normals(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Normals averaged over the faces of a vertex, by area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], face)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


KNOT_ACROSS = 24


def knot(around: int = 260, tube: float = 0.21, twist: int = 5) -> tuple[Array, NDArray[np.int64]]:
    """A trefoil knot: a tube, twisted, around the curve that winds twice and thrice around a torus."""
    t = np.linspace(0, 2 * np.pi, around, endpoint=False)
    radius = 0.62 + 0.30 * np.cos(3 * t)
    curve = np.stack([radius * np.cos(2 * t), radius * np.sin(2 * t), 0.34 * np.sin(3 * t)], -1)
    tangent = np.roll(curve, -1, 0) - np.roll(curve, 1, 0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # Frame of the tube: the direction away from the torus' own axis circle, made orthogonal to the tangent
    outward = curve - 0.62 * np.stack([np.cos(2 * t), np.sin(2 * t), 0 * t], -1)
    outward -= (outward * tangent).sum(1, keepdims=True) * tangent
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    side = np.cross(tangent, outward)
    s = twist * t[:, None, None] + np.linspace(0, 2 * np.pi, KNOT_ACROSS, endpoint=False)[:, None]
    ring = np.cos(s) * outward[:, None] + np.sin(s) * side[:, None]
    return (curve[:, None] + tube * ring).reshape(-1, 3), grid_faces(around, KNOT_ACROSS)[:, ::-1]


def striped(tube: Mesh, colour: tuple[float, float, float], every: int = 6) -> tuple[Mesh, Mesh]:
    """Split a tube's faces along its length into the body and stripes of one face's width."""
    across = np.arange(len(tube.faces)) // 2 % KNOT_ACROSS
    stripe = across % every == 0
    return (
        used_only(replace(tube, faces=tube.faces[~stripe])),
        used_only(replace(tube, name=tube.name + "-stripes", faces=tube.faces[stripe], colour=np.array(colour))),
    )


def used_only(mesh: Mesh) -> Mesh:
    """Drop the vertices that no face uses."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    return replace(
        mesh, vertices=mesh.vertices[used], normals=mesh.normals[used], faces=faces.reshape(mesh.faces.shape)
    )


def superquadric(power: float, rows: int = 40, columns: int = 64) -> tuple[Array, NDArray[np.int64]]:
    """|x|^p + |y|^p + |z|^p = 1: p > 2 a rounded box, p < 1 a star."""
    theta = np.linspace(1e-3, np.pi - 1e-3, rows)[:, None]
    phi = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None]
    direction = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta) + 0 * phi, np.sin(theta) * np.sin(phi)], -1)
    scale = (np.abs(direction) ** power).sum(-1, keepdims=True) ** (-1 / power)
    faces = grid_faces(rows, columns, wrap_rows=False)
    return (direction * scale).reshape(-1, 3), faces[:, ::-1]


def rotation(axis: Array, degrees: float) -> Array:
    """Matrix of a rotation (Rodrigues)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k


def body(
    name: str,
    shape: tuple[Array, NDArray[np.int64]],
    colour: tuple[float, float, float],
    *,
    at: tuple[float, float, float],
    scale: float = 1.0,
    turn: Array | None = None,
    roughness: float = 0.12,
) -> Mesh:
    """Place a surface that rests on the floor at (x, y, z)."""
    vertices, faces = shape
    vertices = scale * vertices @ (np.eye(3) if turn is None else turn).T
    vertices[:, 1] -= vertices[:, 1].min()
    vertices = vertices + np.asarray(at)
    return Mesh(name, vertices, faces, np.array(colour), vertex_normals(vertices, faces), roughness)


def floor(tiles: int = 44, size: float = 0.62) -> tuple[Mesh, Mesh]:
    """Light and dark tiles, separate meshes, so that their edges are exact."""
    turn = rotation(np.array([0, 1, 0]), 38)
    both = []
    for parity, name, colour in ((0, "tiles-light", (0.80, 0.77, 0.70)), (1, "tiles-dark", (0.045, 0.11, 0.14))):
        i, j = np.nonzero((np.add.outer(np.arange(tiles), np.arange(tiles)) % 2) == parity)
        corners = np.array([[0, 0], [0, 1], [1, 1], [1, 0]])
        at = (np.stack([i, j], -1)[:, None] + corners - tiles / 2) * size
        vertices = np.stack([at[..., 0], 0 * at[..., 0], at[..., 1]], -1).reshape(-1, 3) @ turn.T
        vertices += [0, 0, -5]
        first = 4 * np.arange(len(i))[:, None]
        faces = (first[..., None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
        normals = np.tile([0.0, 1.0, 0.0], (len(vertices), 1))
        both.append(Mesh(name, vertices, faces, np.array(colour), normals, smooth=False))
    return both[0], both[1]


def hue(h: float, saturation: float = 0.85, value: float = 0.75) -> Array:
    """A colour of the wheel, h in [0, 1)."""
    ramp = np.clip(np.abs((h * 6 + np.array([0, 4, 2])) % 6 - 3) - 1, 0, 1)
    return value * (1 - saturation + saturation * ramp) ** 1.6


def sphere_row() -> list[Ball]:
    """Spheres from near the lens into the distance."""
    balls = []
    for k in range(11):
        z = 4.1 - 1.55 * k
        x = -1.45 - 0.17 * k + 0.10 * np.sin(1.7 * k)
        balls.append(Ball(np.array([x, 0.36, z]), 0.36, hue(0.02 + 0.075 * k)))
    return balls


def beads(rng: np.random.Generator) -> list[Ball]:
    """Metal beads, scattered behind the knot and a few before it."""
    balls: list[Ball] = []
    while len(balls) < 110:
        z = rng.uniform(-13, 3.6)
        x = rng.uniform(-0.9, 0.62 * (8.5 - z) * 0.62 + 0.4)
        radius = rng.uniform(0.07, 0.15)
        centre = np.array([x, radius, z])
        near_knot = np.hypot(x, z) < 1.5 or (x > 0.9 and z > 1.0)
        if near_knot or any(np.linalg.norm(b.centre - centre) < b.radius + radius + 0.05 for b in balls):
            continue
        balls.append(Ball(centre, radius, METALS[len(balls) % 3], metal=True))
    return balls


def backdrop() -> Mesh:
    """A far wall that shows the sky: a strip of a cylinder."""
    angles = np.radians(np.linspace(200, 340, 24))
    heights = np.linspace(-1, 14, 12)
    a, h = np.meshgrid(angles, heights, indexing="ij")
    vertices = np.stack([24 * np.cos(a), h, 24 * np.sin(a)], -1).reshape(-1, 3)
    faces = grid_faces(24, 12, wrap_rows=False, wrap_columns=False)
    inward = -vertices * [1, 0, 1]
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return Mesh("sky", vertices, faces, np.zeros(3), inward)


# ---------------------------------------------------------------------- fill light


def sky(direction: Array) -> Array:
    """Radiance (m, 3) of the fill light from `direction` (m, 3)."""
    up = np.clip(direction[:, 1:2], 0, 1) ** 0.5
    return SKY * ((1 - up) * HORIZON + up * ZENITH)


def fibonacci_sphere(n: int) -> Array:
    """n directions, evenly spread over the sphere."""
    k = np.arange(n) + 0.5
    y, angle = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - y * y)
    return np.stack([r * np.cos(angle), y, r * np.sin(angle)], -1)


def fill(scene: mi.Scene, points: Array, normals: Array) -> Array:
    """Σ sky(ω) visible(ω) max(n·ω, 0) Δω / π: outgoing fill radiance of a white surface, (m, 3)."""
    total = np.zeros_like(points)
    for direction in fibonacci_sphere(OCCLUSION_DIRECTIONS):
        cosine = np.clip(normals @ direction, 0, None)
        if direction[1] <= 0:
            # The floor below reflects a little
            total += 0.12 * cosine[:, None] * HORIZON * SKY
            continue
        origin = points + 2e-3 * normals
        ray = mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction[:, None]))
        visible = ~np.array(scene.ray_test(ray))
        total += (cosine * visible)[:, None] * sky(direction[None])
    return total * 4 / OCCLUSION_DIRECTIONS  # Δω / π = 4π / n / π


# ---------------------------------------------------------------------- files


def mitsuba_mesh(mesh: Mesh, ambient: Array | None = None) -> mi.Mesh:
    """The mesh with its fill radiance as a vertex attribute."""
    made = mi.Mesh(mesh.name, len(mesh.vertices), len(mesh.faces), has_vertex_normals=mesh.smooth)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = mesh.vertices.astype(np.float32).ravel()
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    if mesh.smooth:
        parameters["vertex_normals"] = mesh.normals.astype(np.float32).ravel()
    parameters.update()
    if ambient is not None:
        made.add_attribute("vertex_fill", 3, ambient.astype(np.float32).ravel())
    return made


def occluders(meshes: list[Mesh], balls: list[Ball]) -> mi.Scene:
    """What keeps the sky's light away."""
    parts = {f"mesh{k}": mitsuba_mesh(m) for k, m in enumerate(meshes)}
    parts |= {
        f"ball{k}": {"type": "sphere", "center": b.centre.tolist(), "radius": b.radius} for k, b in enumerate(balls)
    }
    return mi.load_dict({"type": "scene", **parts})


def add_emission(shape: xml.Element, radiance: Array | None) -> None:
    """The fill light of a shape: constant, or (None) the mesh's vertex attribute; never sampled."""
    emitter = add(shape, "emitter", type="area")
    if radiance is None:
        add(add(emitter, "texture", type="mesh_attribute", name="radiance"), "string", name="name", value="vertex_fill")
    else:
        add(emitter, "rgb", name="radiance", value=radiance)
    add(emitter, "float", name="sampling_weight", value=0)


def add_material(root: xml.Element, name: str, colour: Array, roughness: float | None, metal: bool = False) -> None:
    """Diffuse, plastic or metal; shapes refer to it by name, since each material more costs rendering time."""
    if metal:
        bsdf = add(root, "bsdf", type="roughconductor", id=name)
        add(bsdf, "string", name="material", value="none")
        add(bsdf, "rgb", name="specular_reflectance", value=colour)
        add(bsdf, "float", name="alpha", value=0.16)
    elif roughness is None:
        add(add(root, "bsdf", type="diffuse", id=name), "rgb", name="reflectance", value=colour)
    else:
        bsdf = add(root, "bsdf", type="roughplastic", id=name)
        add(bsdf, "rgb", name="diffuse_reflectance", value=colour)
        add(bsdf, "float", name="alpha", value=roughness)


def scene_xml(meshes: list[Mesh], balls: list[Ball], ball_fill: list[Array]) -> xml.Element:
    """The scene description."""
    root = xml.Element("scene", version="3.0.0")
    root.append(xml.Comment(" Made by scenes/depth_of_field.py "))
    for name, value in (("width", 320), ("height", 240), ("spp", 64)):
        add(root, "default", name=name, value=value)

    integrator = add(root, "integrator", type="direct")
    add(integrator, "integer", name="emitter_samples", value=1)
    add(integrator, "integer", name="bsdf_samples", value=0)

    sensor = add(root, "sensor", type="thinlens")
    add(sensor, "float", name="fov", value=36)
    add(sensor, "string", name="fov_axis", value="x")
    add(sensor, "float", name="aperture_radius", value=0.12)
    add(sensor, "float", name="focus_distance", value=(FOCUS - EYE) @ (TARGET - EYE) / np.linalg.norm(TARGET - EYE))
    to_world = add(sensor, "transform", name="to_world")
    add(to_world, "lookat", origin=EYE, target=TARGET, up=[0, 1, 0])
    add(add(sensor, "sampler", type="independent"), "integer", name="sample_count", value="$spp")
    film = add(sensor, "film", type="hdrfilm")
    add(film, "integer", name="width", value="$width")
    add(film, "integer", name="height", value="$height")
    add(film, "rfilter", type="box")

    sun = add(root, "emitter", type="directional")
    add(sun, "vector", name="direction", value=SUN)
    add(sun, "rgb", name="irradiance", value=[2.9, 2.65, 2.25])

    def material(ball: Ball) -> tuple[bool, tuple[float, ...]]:
        return ball.metal, tuple(ball.colour.tolist())

    for mesh in meshes:
        add_material(root, f"{mesh.name}-material", mesh.colour, mesh.roughness)
    materials: dict[tuple[bool, tuple[float, ...]], str] = {}
    for ball in balls:
        if material(ball) not in materials:
            materials[material(ball)] = f"ball-material-{len(materials)}"
            add_material(root, materials[material(ball)], ball.colour, 0.1, ball.metal)

    for mesh in meshes:
        shape = add(root, "shape", type="ply")
        add(shape, "string", name="filename", value=f"meshes/{mesh.name}.ply")
        add(shape, "ref", id=f"{mesh.name}-material")
        add_emission(shape, None)
    for ball, radiance in zip(balls, ball_fill, strict=True):
        shape = add(root, "shape", type="sphere")
        add(shape, "point", name="center", value=ball.centre)
        add(shape, "float", name="radius", value=ball.radius)
        add(shape, "ref", id=materials[material(ball)])
        add_emission(shape, radiance)
    return root


def write(folder: Path) -> Path:
    """Make the scene in `folder`; returns the path of its XML file."""
    solids = [
        *striped(body("knot", knot(), (0.75, 0.09, 0.05), at=(0.15, 0, 0), turn=rotation(np.array([0, 1, 0]), 20)),
                 (0.85, 0.78, 0.62)),
        body("box", superquadric(4.5), (0.10, 0.32, 0.55), at=(1.75, 0, 2.15), scale=0.42,
             turn=rotation(np.array([0, 1, 0]), 30)),
        body("star", superquadric(0.75), (0.9, 0.55, 0.08), at=(2.35, 0, -2.6), scale=0.95,
             turn=rotation(np.array([1, 0, 0.4]), 25)),
    ]  # fmt: skip
    balls = sphere_row() + beads(np.random.default_rng(5))
    scene = occluders(solids, balls)

    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    wall = backdrop()
    meshes = [*floor(), *solids]
    for mesh in meshes:
        ambient = mesh.colour * fill(scene, mesh.vertices, mesh.normals)
        mitsuba_mesh(mesh, ambient).write_ply(str(folder / "meshes" / f"{mesh.name}.ply"))
    looking = wall.vertices - EYE
    mitsuba_mesh(wall, sky(looking / np.linalg.norm(looking, axis=1, keepdims=True))).write_ply(
        str(folder / "meshes" / f"{wall.name}.ply")
    )
    ball_fill = []
    for ball in balls:
        outward = fibonacci_sphere(64)
        seen = fill(scene, ball.centre + ball.radius * outward, outward).mean(0)
        ball_fill.append(np.asarray(ball.colour) * seen * (0.75 if ball.metal else 1))

    root = scene_xml([*meshes, wall], balls, ball_fill)
    xml.indent(root)
    path = folder / "depth-of-field.xml"
    path.write_text(xml.tostring(root, encoding="unicode") + "\n", encoding="utf-8")
    return path


if __name__ == "__main__":
    mi.set_variant("llvm_ad_rgb")
    print(write(Path(sys.argv[1]) if len(sys.argv) > 1 else DESTINATION))
