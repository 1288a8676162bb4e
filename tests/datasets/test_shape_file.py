"""Shape files: both layouts, and what is refused."""

import numpy as np
import pytest
from tests.models.physics.shapes import cube

from unmodeled.core.errors import ConfigError, DataError
from unmodeled.datasets.shape_file import read_shape

CUBE = cube()
VERTICES = ["v " + " ".join(f"{x:g}" for x in v) for v in CUBE.vertices]
FACES = ["f " + " ".join(str(k + 1) for k in f) for f in CUBE.faces]


def file(tmp_path, lines, name="a.obj"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n")
    return path


def test_an_obj_file(tmp_path):
    words = ["# a cube", "o body", *VERTICES, "vn 0 0 1", *FACES]
    got = read_shape(file(tmp_path, words), 1000.0)
    np.testing.assert_array_equal(got.vertices, 1000.0 * CUBE.vertices)
    np.testing.assert_array_equal(got.faces, CUBE.faces)
    assert (got.name, got.unit) == ("a.obj", 1000.0)


def test_polygons_textures_and_numbers_from_the_end(tmp_path):
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    words = ["f " + " ".join(f"{k - 8}/1/2" for k in side) for side in sides]
    assert read_shape(file(tmp_path, VERTICES + words), 1.0) == CUBE


@pytest.mark.parametrize("together", [True, False])
@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize("first", [0, 1])
def test_a_plate_model(tmp_path, together, numbered, first):
    def row(k, values):
        return " ".join(str(v) for v in ([k + 1] if numbered else []) + list(values))

    head = ["8 12"] if together else ["8"]
    words = [*head, *(row(k, v) for k, v in enumerate(CUBE.vertices))]
    words += [] if together else ["12"]
    words += [row(k, f + first) for k, f in enumerate(CUBE.faces)]
    assert read_shape(file(tmp_path, words, "a.tab"), 1.0) == CUBE


@pytest.mark.parametrize(
    ("lines", "name", "message"),
    [
        ([], "a.tab", "is empty"),
        (VERTICES, "a.obj", "8 vertices and 0 faces"),
        ([*VERTICES, *FACES[:-1]], "a.obj", "not closed"),
        ([*VERTICES, "v 1 2 x", *FACES], "a.obj", "line 9 is not part of a shape. Allowed: num"),
        ([*VERTICES, "w 1", *FACES], "a.obj", "line 9 is not part"),
        ([*VERTICES, "v nan 0 0", *FACES], "a.obj", "1 value"),
        (["8 12", "1 2 3"], "a.tab", "states 8 rows and has 1 left"),
        (["4", *["1 2"] * 4], "a.tab", "three numbers"),
        (["4", *["1 2 3"] * 4], "a.tab", "ends after 4 vertices"),
        (["1 2"], "a.stl", "suffix"),
    ],
)
def test_damaged_files_are_refused(tmp_path, lines, name, message):
    with pytest.raises(DataError, match=message):
        read_shape(file(tmp_path, lines, name), 1.0)


def test_a_scale_and_a_file_are_needed(tmp_path):
    with pytest.raises(ConfigError, match=r"scale of a\.obj is 0"):
        read_shape(file(tmp_path, VERTICES + FACES), 0.0)
    with pytest.raises(DataError, match="there is no shape"):
        read_shape(tmp_path / "b.obj", 1.0)
