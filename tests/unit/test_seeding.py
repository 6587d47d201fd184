from odisar.seeding import derive_seed, generator


def test_a_seed_is_the_same_on_every_machine():
    assert derive_seed(1, "training", "vessel-all") == 8629482669132631382


def test_names_give_streams_of_their_own():
    assert derive_seed(1, "a") != derive_seed(1, "b") != derive_seed(2, "b")
    assert derive_seed(1, "a", "b") != derive_seed(1, "ab")
    assert generator(1, "a").random() == generator(1, "a").random()
