from odisar.evaluation.leakage_probes import PROBES
from odisar.evaluation.leakage_report import LEAKAGE_COLUMNS, leakage_table

from .leaky_scores import RECORDINGS, flinches, honest, is_constant, of_each, peeks, probe


def test_the_table_has_a_row_for_each_probe_and_counts_what_moved():
    table = leakage_table([probe(honest), probe(of_each(peeks))])
    assert tuple(table.columns) == LEAKAGE_COLUMNS
    assert table["probe"].tolist() == list(PROBES) * 2
    assert table["moved"].tolist() == [0, 0, 0, 0, 0, 9, 0, 36, 9, 0, 0, 9]
    assert table["positions"].tolist() == [3, 36, 9, 18, 6, 9] * 2


def test_each_finding_is_told_in_a_sentence():
    sentences = probe(of_each(flinches), RECORDINGS[:1], positions_per_recording=1).sentences()
    assert sentences[0] == (
        "mine, repeat: asking again about the same recording moved a score in 0 of 1 tries."
    )
    assert sentences[1].startswith(
        "mine, future: changing all samples after one moved a score up to it in 3 of 4 tries, "
        "most at sample "
    )
    assert " of 'calm' (all channels pushed after " in sentences[1]
    assert "): by 1, " in sentences[1]
    assert sentences[-1].endswith("moved the score at that sample in 1 of 1 tries.")


def test_a_score_that_never_moves_is_told_so():
    sentence = probe(of_each(is_constant)).sentences()[-1]
    assert "moved the score at that sample in 0 of 9 tries" in sentence
    assert sentence.endswith("it never moved.")
