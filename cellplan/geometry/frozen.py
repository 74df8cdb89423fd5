"""Fields of frozen classes that follow from the others."""


def derive(instance: object, **values: object) -> None:
    """Set fields of a frozen instance that follow from the others; only what makes the instance may call it."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)
