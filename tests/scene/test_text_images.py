"""The image of texts that the 3D view draws."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("app")


def box(image: Any, text: str, edges: bool = False) -> list[int]:
    """Return left, top, width and height of a text in the image, in pixels."""
    ((left, top, wide, high),), _ = image.places([text], edges=edges)
    rows, columns = image.pixels.shape
    return [round(number) for number in (left * columns, top * rows, wide * columns, high * rows)]


def part(image: Any, text: str, edges: bool = False) -> Any:
    """Return the pixels of a text."""
    left, top, wide, high = box(image, text, edges)
    return image.pixels[top : top + high, left : left + wide]


def test_only_texts_that_are_new_are_painted() -> None:
    from rosglass.scene.render.text_images import TextImage

    image = TextImage(4096)
    assert image.set_texts(["one", "two"]) == (0, len(image.pixels))
    one = part(image, "one").copy()
    assert one.max() == 255
    assert not np.array_equal(one, part(image, "two"))
    assert image.set_texts(["two", "one", "one"]) == (0, 0)
    # Without room, all that are there are painted anew, with room for further ones.
    assert image.set_texts(["one", "three"]) == (0, len(image.pixels))
    with pytest.raises(KeyError):
        image.places(["two"])
    assert np.array_equal(part(image, "one"), one)
    pixels = image.pixels
    top, bottom = image.set_texts(["one", "four"])
    assert image.pixels is pixels
    assert 0 <= top < bottom <= len(pixels)
    assert part(image, "four").max() == 255
    assert np.array_equal(part(image, "one"), one)


def test_a_text_that_is_wider_than_the_image_is_painted_as_a_whole() -> None:
    from rosglass.scene.render.text_images import TextImage

    image = TextImage(4096)
    for texts in (["9.9"], ["9.8"]):  # from the second time on, there is room below
        image.set_texts(texts)
    wide = "much wider than those before it"
    image.set_texts(["9.8", wide])
    assert part(image, wide).shape[1] == box(image, wide)[2]
    places, _ = image.places([wide])
    assert (places[:, :2] + places[:, 2:]).max() <= 1


def test_an_image_of_ever_other_texts_stays_small() -> None:
    from rosglass.scene.render.text_images import TextImage

    image = TextImage(4096)
    kept = [f"label {number}" for number in range(50)]
    sizes = set()
    for number in range(500):
        image.set_texts([*kept, f"{number} m/s"])
        sizes.add(image.pixels.size)
    assert len(sizes) < 10
    assert max(sizes) < 4 * min(sizes)
    with pytest.raises(KeyError):
        image.places(["9 m/s"])


def test_texts_have_places_and_sizes_in_lines_or_no_room() -> None:
    from rosglass.scene.render.text_images import TextImage

    image = TextImage(256)
    texts = ["a", "b\nc", "", "wide " * 100]
    image.set_texts(texts)
    places, sizes = image.places(texts)
    assert sizes[:, 1].tolist() == [1, 2, 1, 1]
    assert (sizes[3, 0], places.min(), places.max()) == (254 / 32, 0, 1)
    many = [f"text {number}" for number in range(100)]
    image.set_texts(many)
    _, sizes = image.places(many)
    assert 0 < np.count_nonzero(sizes[:, 1]) < 100
    assert max(image.pixels.shape) <= 256
    image.set_texts(many[-3:])
    _, sizes = image.places(many[-3:])
    assert sizes[:, 1].tolist() == [1, 1, 1]


@pytest.mark.parametrize("limit", [64, 256, 1000])
def test_random_texts_are_beside_each_other_in_the_image(limit: int) -> None:
    from rosglass.scene.render.text_images import TextImage

    chance = random.Random(limit)
    for outlined in (False, True) * 5:
        image = TextImage(limit)
        for _ in range(25):
            lengths = [
                chance.choice((0, 1, 3, 10, 60)) for _ in range(chance.choice((0, 1, 5, 30)))
            ]
            texts = ["".join(chance.choices("ab W\n", k=length)) for length in lengths]
            before = image.pixels
            top, bottom = image.set_texts(texts, outlined)
            height, width = image.pixels.shape
            assert 0 <= top <= bottom <= height <= limit
            assert width <= limit
            assert image.pixels is before or (top, bottom) == (0, height)
            used = np.zeros((height, width), int)
            shown = {(text, edges) for text in texts for edges in {False, outlined}}
            for left, upper, wide, high in (box(image, *each) for each in shown):
                assert left + wide <= width or not high
                assert upper + high <= height
                used[upper : upper + high, left : left + wide] += 1
            assert used.max(initial=0) <= 1


def test_edges_are_texts_of_their_own_around_the_letters() -> None:
    from rosglass.scene.render.text_images import TextImage

    image = TextImage(4096)
    image.set_texts(["one"], outlined=True)
    letters, edges = part(image, "one"), part(image, "one", edges=True)
    assert edges.shape == letters.shape
    assert np.count_nonzero(edges) > 1.5 * np.count_nonzero(letters)
    inner, outer = image.places(["one"]), image.places(["one"], edges=True)
    assert not np.array_equal(inner[0], outer[0])
    assert np.array_equal(inner[1], outer[1])
