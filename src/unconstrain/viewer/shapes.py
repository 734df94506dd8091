"""Geoms of a MuJoCo model as triangles, and which of them are meant for the eye."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.robots import import_mujoco

Array = NDArray[np.float64]

Color = tuple[float, float, float, float]

SHOWN_GROUPS = 3
"""Geoms of groups below this one are shown, as MuJoCo's own viewers do at first."""

PLAIN = (0.5, 0.5, 0.5, 1.0)
"""The colour that MuJoCo gives to geoms without one; a material's then counts."""

SIDES = 24
"""Of cylinders and capsules."""

TOO_FINE = 60_000
"""Faces of one shape over which its edges are not looked at: that would take seconds."""

SHARP = 0.7
"""Angle between faces, in radians, from which their common edge is drawn sharp."""

PLANE_SIDE = 4.0
"""Half a side of a plane that is endless, in metres."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A part of a body in one colour.

    Parameters
    ----------
    vertices : ndarray of shape (V, 3)
        In the body's frame, in metres. Those of meshes on sharp edges are there once for each side.
    faces : ndarray of shape (F, 3), int
        Triangles.
    rgba : tuple of float
        Colour and opacity, 0 to 1.
    is_flat : bool
        Whether edges are sharp, as those of boxes.
    """

    vertices: Array
    faces: NDArray[np.int64]
    rgba: Color
    is_flat: bool


def collect_shapes(
    model: Any, leave_out: tuple[str, ...] = ()
) -> tuple[dict[int, list[Shape]], tuple[str, ...]]:
    """Collect the shapes of each body: geoms of one colour are one shape.

    Where a body has shapes made for the eye beside others that collide in another group, as bodies from URDF files
    have, only the former are taken.

    Parameters
    ----------
    model : mujoco.MjModel
        Of a robot, perhaps with things around it.
    leave_out : tuple of str
        Names of geoms that are not wanted.

    Returns
    -------
    shapes : dict of int to list of Shape
        By the number of the body.
    notes : tuple of str
        What cannot be shown, a sentence each.
    """
    shapes: dict[int, list[Shape]] = {}
    missed: list[str] = []
    for body in range(model.nbody):
        first = int(model.body_geomadr[body])
        geoms = [
            geom for geom in range(first, first + int(model.body_geomnum[body])) if _is_shown(model, geom)
        ]
        geoms = [geom for geom in geoms if model.geom(geom).name not in leave_out]
        merged: dict[tuple[Any, bool], list[tuple[Array, NDArray[np.int64]]]] = {}
        for geom in _for_the_eye(model, geoms):
            made = _triangulate(model, geom)
            if made is None:
                missed.append(model.geom(geom).name or f"geom {geom}")
                continue
            vertices, faces, is_flat = made
            turn = np.zeros(9)
            import_mujoco().mju_quat2Mat(turn, model.geom_quat[geom])
            placed = vertices @ turn.reshape(3, 3).T + model.geom_pos[geom]
            merged.setdefault((_find_color(model, geom), is_flat), []).append((placed, faces))
        if merged:
            shapes[body] = [Shape(*_join(parts), *key) for key, parts in merged.items()]
    notes = (
        (f"not drawn, since they are neither meshes nor simple shapes: {', '.join(missed)}",)
        if missed
        else ()
    )
    return shapes, notes


def _is_shown(model: Any, geom: int) -> bool:
    return model.geom_group[geom] < SHOWN_GROUPS and _find_color(model, geom)[3] > 0


def _for_the_eye(model: Any, geoms: list[int]) -> list[int]:
    see_only = [geom for geom in geoms if not (model.geom_contype[geom] or model.geom_conaffinity[geom])]
    groups = {int(model.geom_group[geom]) for geom in see_only}
    apart = all(model.geom_group[geom] not in groups for geom in geoms if geom not in see_only)
    return see_only if see_only and apart else geoms


def _find_color(model: Any, geom: int) -> Color:
    own, material = tuple(model.geom_rgba[geom].tolist()), int(model.geom_matid[geom])
    if material < 0 or own != PLAIN:
        return own
    color = model.mat_rgba[material].copy()
    texture = int(model.mat_texid[material, import_mujoco().mjtTextureRole.mjTEXROLE_RGB])
    if texture >= 0:
        channels, pixels = (
            int(model.tex_nchannel[texture]),
            int(model.tex_height[texture] * model.tex_width[texture]),
        )
        start = int(model.tex_adr[texture])
        image = model.tex_data[start : start + pixels * channels].reshape(pixels, channels)
        color[:3] *= np.resize(image.mean(axis=0), 3) / 255.0
    return tuple(color.tolist())


def _triangulate(model: Any, geom: int) -> tuple[Array, NDArray[np.int64], bool] | None:
    """Return vertices (V, 3) and faces (F, 3) in the geom's frame, and whether its edges are sharp."""
    import trimesh  # slow to import

    kinds = import_mujoco().mjtGeom
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == kinds.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        vertices, faces = (
            values[start : start + count].astype(dtype)
            for values, start, count, dtype in (
                (model.mesh_vert, model.mesh_vertadr[mesh], model.mesh_vertnum[mesh], np.float64),
                (model.mesh_face, model.mesh_faceadr[mesh], model.mesh_facenum[mesh], np.int64),
            )
        )
        return *_split_sharp_edges(vertices, faces), False
    if kind == kinds.mjGEOM_BOX:
        made = trimesh.creation.box(2 * size)
    elif kind == kinds.mjGEOM_PLANE:
        half = np.where(size[:2] > 0, size[:2], PLANE_SIDE)
        corners = np.array([(x, y, 0) for x in (-1, 1) for y in (-1, 1)]) * [*half, 0]
        made = trimesh.Trimesh(corners, [(0, 2, 3), (0, 3, 1)])
    elif kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_ELLIPSOID):
        made = trimesh.creation.icosphere(subdivisions=3)
        made.apply_scale(size if kind == kinds.mjGEOM_ELLIPSOID else size[0])
    elif kind == kinds.mjGEOM_CAPSULE:
        made = trimesh.creation.capsule(2 * size[1], size[0], count=(SIDES, SIDES))
        made.apply_translation(-made.bounds.mean(axis=0))
    elif kind == kinds.mjGEOM_CYLINDER:
        made = trimesh.creation.cylinder(size[0], 2 * size[1], sections=SIDES)
    else:
        return None
    flat = kind in (kinds.mjGEOM_BOX, kinds.mjGEOM_PLANE, kinds.mjGEOM_CYLINDER)
    return np.asarray(made.vertices), np.asarray(made.faces, dtype=np.int64), flat


def _split_sharp_edges(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Give faces on either side of a sharp edge vertices of their own, so that the edge is seen."""
    import trimesh  # slow to import

    if len(faces) > TOO_FINE:
        return vertices, faces
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    parts = trimesh.graph.smooth_shade(mesh, angle=SHARP)
    return np.asarray(parts.vertices), np.asarray(parts.faces, dtype=np.int64)


def _join(parts: list[tuple[Array, NDArray[np.int64]]]) -> tuple[Array, NDArray[np.int64]]:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    return (
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate([faces + offset for (_, faces), offset in zip(parts, offsets, strict=True)]),
    )
