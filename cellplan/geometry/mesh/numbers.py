"""Numbers in foreign text files, read strictly."""


def plain_word(word: str) -> str:
    """The word, if it is written as other programs write numbers: Python alone also takes ``1_000`` and ``٣``.

    Raises:
        ValueError: It holds an underscore, or a digit of another script.
    """
    if "_" in word or not word.isascii():
        raise ValueError(f"not a plain number: {word!r}")
    return word
