from odisar.recordings.quality import Finding
from odisar.stages.preprocess import print_warnings


def warning(file, column):
    return Finding("warning", file, column, 1, "", "the column is not declared", "add it")


def test_a_warning_about_many_files_is_one_line(capsys):
    print_warnings([warning(f"data/{i}.csv", "speed") for i in range(12)] + [warning("a", "mode")])
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "warning: data/0.csv and 11 other files, speed: the column is not declared; add it",
        "warning: a, mode: the column is not declared; add it",
    ]
