from odisar.baselines.neural.registry import NOT_DEPLOYABLE, neural_detectors

from .neural_cases import BUDGET


def test_the_detectors_have_their_names_in_a_fixed_order():
    assert list(neural_detectors(BUDGET)) == [
        "rnn-then-autoencoder",
        "gru-reconstruction",
        "input-reconstruction",
        "published-recipe",
        "published-recipe-last-state",
        "ensemble-variance",
        "ensemble-reconstruction",
        "codit",
    ]


def test_the_published_recipes_are_not_deployable():
    assert NOT_DEPLOYABLE == ("published-recipe", "published-recipe-last-state")


def test_every_call_makes_a_detector_of_its_own():
    for make in neural_detectors(BUDGET).values():
        assert make() is not make()
