"""Numbers in foreign text files, read strictly."""

import warnings
from contextlib import suppress
from typing import Final

import numpy as np
from numpy.typing import NDArray

MAX_WORDS: Final = 15_000_000  # of a text file: ten columns for each vertex of the largest allowed mesh
CHUNK: Final = 1_000_000  # [bytes] of text made into numbers at once


def plain_word(word: str) -> str:
    """The word, if it is written as other programs write numbers: Python alone also takes ``1_000`` and ``٣``."""
    if "_" in word or not word.isascii():
        raise ValueError(f"not a plain number: {word!r}")
    return word


def text_numbers(body: bytes) -> NDArray[np.float64]:
    """All numbers of a text; ``ValueError`` where a word is none, or there are more than any sound mesh has."""
    is_ink = np.concatenate([[False], np.frombuffer(body, dtype=np.uint8) > ord(" ")])
    words = int(np.count_nonzero(is_ink[1:] & ~is_ink[:-1]))
    if words > MAX_WORDS:
        raise ValueError(f"it has more than {MAX_WORDS} numbers")
    with warnings.catch_warnings(), suppress(ValueError, DeprecationWarning):
        warnings.simplefilter("error")  # older versions of NumPy only warn of what they cannot read
        values = np.fromstring(body, dtype=np.float64, sep=" ") if words else np.zeros(0)
        if len(values) == words:  # it reads 1-2 as two numbers
            return values
    return _numbers_of_words(body)


def _numbers_of_words(body: bytes) -> NDArray[np.float64]:
    """All numbers of a text, piece by piece, for a list of all words would take ten times its memory."""
    if b"_" in body:  # NumPy reads 1_000 as a number, as Python does
        raise ValueError("a number contains '_'")
    pieces, start = [np.zeros(0)], 0
    while start < len(body):
        end = start + CHUNK
        while end < len(body) and not body[end : end + 1].isspace():
            end += 1
        pieces.append(np.array(body[start:end].split(), dtype=np.float64))
        start = end
    return np.concatenate(pieces)
