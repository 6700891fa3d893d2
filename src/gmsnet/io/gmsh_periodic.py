"""The section ``$Periodic`` of a Gmsh file: nodes that are images of others, across periodic curves and surfaces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmsnet.io import gmsh_sections as sections
from gmsnet.io.cells import joined, places_of, sealed
from gmsnet.io.words import TextWords, Words
from gmsnet.kernels.topology.sorted_unique import sorted_unique

_AFFINE = 17  # tokens of a transformation of version 2.2: a word and 16 numbers


def read_images(words: Words, old: bool) -> NDArray[np.int64]:
    """(n, 2) the tags of nodes and of those that they are images of. old: version 2.2."""
    found = []
    for _ in range(sections.counts(words, 1)[0]):
        sections.skip(words, (3, "i4"))  # dimension, entity, its master
        if not old:
            sections.skip(words, (sections.counts(words, 1)[0], "f8"))
        elif _is_word(words, b"Affine"):
            sections.skip(words, (_AFFINE, "f8"))
        (count,) = sections.counts(words, 1)
        found.append(words.values(words.take(2 * count, "u8"), "u8"))
    return joined(found).reshape(-1, 2)


def _is_word(words: Words, word: bytes) -> bool:
    return isinstance(words, TextWords) and words.at < words.end and words.text.token(words.starts[words.at]) == word


def nodes_of_images(images: NDArray[np.int64], tags: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) the nodes on either side, counted from 0, without those that are not in the file. tags: of all nodes."""
    known = images[np.isin(images, tags).all(axis=1)]
    return sealed(sorted_unique(places_of(tags, known.reshape(-1))[0]) if len(known) else np.empty(0, dtype=np.int64))
