"""Reading triangle meshes from files: whatever trimesh reads, checked first."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.errors import DataError, NrdfError
from nrdf.geometry.mesh import check_coordinate_range, check_mesh, clean_mesh
from nrdf.io.files import open_file, read_file
from nrdf.io.formats.mesh_claims import check_claimed_sizes

MESH_ENDINGS = (".ply", ".obj", ".off", ".stl", ".glb", ".gltf", ".3mf", ".dae")
_MOST_BESIDE = 250_000_000  # bytes of a file that a mesh names


def load_mesh(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) float64, in the file's unit, and faces (f, 3) int64 of the mesh `path`.

    PLY, OBJ, OFF, STL, GLB, glTF, 3MF or DAE; a scene's meshes are put together. Equal vertices are
    merged, faces without area and repeated faces left out. Raises DataError if the file cannot be
    read, claims more than it holds, or holds no surface, vertices that are not finite or beyond
    all sizes, or too many faces.
    """
    import trimesh

    path = Path(path)
    logging.getLogger("trimesh").setLevel(logging.ERROR)
    if path.suffix.lower() not in MESH_ENDINGS:
        raise DataError(f"{path}: no mesh that can be read; known: {', '.join(MESH_ENDINGS)}")
    with open_file(path, DataError) as file:
        try:
            check_claimed_sizes(path, file)
            file.seek(0)
            if file.read(3) != b"\xef\xbb\xbf":  # a byte-order mark hides the first line
                file.seek(0)
            beside: Any = _Beside(path)
            mesh: Any = trimesh.load(
                file,
                file_type=path.suffix.lower()[1:],
                resolver=beside,
                process=False,
                skip_materials=True,  # and the pictures that they name
            )
            if isinstance(mesh, trimesh.Scene):
                mesh = mesh.to_mesh()
        except NrdfError as error:
            why = str(error).removeprefix(f"{path}: ")
            raise DataError(f"{path}: unreadable as a mesh: {why}") from error
        except Exception as error:  # trimesh raises whatever its parsers raise
            why = str(error) or type(error).__name__
            raise DataError(f"{path}: unreadable as a mesh, truncated or damaged: {why}") from error
    faces = np.asarray(getattr(mesh, "faces", np.empty((0, 3))), dtype=np.int64)
    vertices = np.asarray(getattr(mesh, "vertices", np.empty((0, 3))), dtype=np.float64)
    del mesh
    try:
        vertices, faces = check_mesh(vertices, faces)
        check_coordinate_range(vertices)
        return clean_mesh(vertices, faces)
    except DataError as error:
        raise DataError(f"{path}: {error}") from error


class _Beside:
    """The files that a mesh names, for trimesh: those of its own folder, and regular ones only."""

    def __init__(self, path: Path) -> None:
        self._folder = path.parent.resolve()

    def get(self, name: str) -> bytes:
        place = (self._folder / name).resolve()
        if self._folder not in place.parents:
            raise DataError(f"it names the file {name}, which is outside its folder")
        return read_file(place, DataError, _MOST_BESIDE)

    __getitem__ = get
