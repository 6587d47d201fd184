"""How a CSV file is written is found out from its first lines."""

import pytest

from odisar.proposals.csv_sniffing import sniff_csv
from odisar.proposals.samples import UnusableError

ROWS = [[f"{i / 4:.2f}", f"{1.5 + i % 3:.2f}", f"{-0.25 * i:.3f}"] for i in range(40)]
SIGNS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "space": " "}


def lines(sign=",", decimal=".", header=("t", "v", "w")):
    body = [sign.join(cell.replace(".", decimal) for cell in row) for row in ROWS]
    return "\n".join([sign.join(header), *body]) + "\n"


@pytest.fixture
def sniff(tmp_path):
    def sniff_content(content):
        path = tmp_path / "a.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return sniff_csv(path)

    return sniff_content


@pytest.mark.parametrize(
    ("separator", "decimal"),
    [(s, d) for s in SIGNS for d in ("point", "comma") if (s, d) != ("comma", "comma")],
)
def test_separator_and_decimal_sign_are_told_apart(sniff, separator, decimal):
    sample = sniff(lines(SIGNS[separator], "." if decimal == "point" else ","))
    assert (sample.layout.separator, sample.layout.decimal) == (separator, decimal)
    assert sample.columns == ["t", "v", "w"]
    assert sample.table["w"].iloc[2] == -0.5
    assert not sample.obstacles


def test_whole_numbers_alone_are_taken_with_a_decimal_point(sniff):
    sample = sniff("t;n\n" + "".join(f"{i};{i % 7}\n" for i in range(30)))
    assert (sample.layout.separator, sample.layout.decimal) == ("semicolon", "point")


@pytest.mark.parametrize(
    ("encoding", "found"), [("utf-8-sig", "utf-8-sig"), ("utf-16", "utf-16"), ("latin-1", "cp1252")]
)
def test_the_encoding_is_found(sniff, encoding, found):
    sample = sniff(lines(header=("t", "v [°/s]", "w")).encode(encoding))
    assert sample.encoding == found
    assert sample.columns[1] == "v [°/s]"
    assert ("encoding" in sample.obstacles) == (found != "utf-8-sig")


def test_a_line_of_units_below_the_header_is_found(sniff):
    text = lines().replace("t,v,w\n", "t,v,w\n[s],m/s,-\n")
    sample = sniff(text)
    assert sample.units == {"t": "s", "v": "m/s", "w": "-"}
    assert "units" in sample.obstacles
    assert len(sample.table) == len(ROWS)


def test_lines_before_the_header_are_counted(sniff):
    sample = sniff("Logger 3\nstarted 12:00\n" + lines(";", ","))
    assert sample.columns == ["t", "v", "w"]
    assert sample.obstacles["preamble"].startswith("2 line(s)")


def test_separators_at_the_ends_of_lines_and_blank_lines_are_no_columns(sniff):
    text = "".join(f"{line};\n\n" for line in lines(";").splitlines())
    sample = sniff(text)
    assert sample.columns == ["t", "v", "w"]
    assert len(sample.table) == len(ROWS)


def test_a_column_of_words_stays_text_and_one_with_a_few_gaps_is_numbers(sniff):
    text = "t,mode,v\n" + "".join(f"{i},auto,{'' if i == 3 else i / 2}\n" for i in range(20))
    table = sniff(text).table
    assert table["mode"].iloc[0] == "auto"
    assert table["v"].isna().sum() == 1


def test_repeated_columns_are_named_and_taken_once(sniff):
    sample = sniff(lines(header=("t", "v", "v")))
    assert sample.columns == ["t", "v"]
    assert sample.remarks == ("it has more than one column called v",)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "it is empty"),
        (b"\xef\xbb\xbf \n", "it is empty"),
        (b"\x00\x01\x02PK", "it is binary"),
        (b"t,v\n", "no table of at least two columns"),
        (b"just words\nand more words here\n", "no table of at least two columns"),
        (b"0.0,1.0\n0.1,1.1\n0.2,1.2\n", "no line of column names: write one, as in time_s,x1"),
        (b't,v\n0,1\n1,2\n"2,3\n3,4\n', "close every quote"),
    ],
)
def test_a_file_that_tells_nothing_says_why(sniff, content, reason):
    with pytest.raises(UnusableError, match=reason):
        sniff(content)


def test_a_folder_with_the_name_of_a_file_is_one(tmp_path):
    with pytest.raises(UnusableError, match="it is a folder"):
        sniff_csv(tmp_path)
