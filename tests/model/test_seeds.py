"""Generators by name: the same for the same name and seed, on every machine."""

from cellplan.model.seeds import generator


def test_a_generator_depends_on_name_and_seed_alone() -> None:
    first = generator("kuka", 3).uniform(size=4).tolist()

    assert generator("kuka", 3).uniform(size=4).tolist() == first
    assert generator("abb", 3).uniform(size=4).tolist() != first
    assert generator("kuka", 4).uniform(size=4).tolist() != first


def test_a_generator_is_the_same_in_every_process() -> None:
    assert generator("kuka").integers(1000, size=3).tolist() == EXPECTED


EXPECTED = [321, 108, 987]
