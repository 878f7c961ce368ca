"""CSV reading: every fault names row and column."""

from __future__ import annotations

import pytest

from er3a.errors import InputError
from er3a.files.csv_file import CsvColumn, read_csv

COLUMNS = {
    "name": CsvColumn(str),
    "grade": CsvColumn(str, choices=("official", "cad")),
    "count": CsvColumn(int),
    "x_mm": CsvColumn(),
    "angle_deg": CsvColumn(optional=True),
}
HEADER = "name,grade,count,x_mm,angle_deg\n"
GOOD = "reach,official,1,592.8,90\n"


@pytest.fixture
def write(tmp_path):
    def write(content: str | bytes):
        path = tmp_path / "table.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def test_rows_with_types_and_file_lines(write):
    rows = read_csv(write(HEADER + GOOD + '\n"far, far",cad,-2,1e3,\n'), COLUMNS)
    assert rows == [
        {"row": 2, "name": "reach", "grade": "official", "count": 1, "x_mm": 592.8, "angle_deg": 90.0},
        {"row": 4, "name": "far, far", "grade": "cad", "count": -2, "x_mm": 1000.0, "angle_deg": None},
    ]


def test_columns_may_come_in_any_order_with_spaces_and_a_byte_order_mark(write):
    content = "\ufeffx_mm, count ,name,angle_deg,grade\r\n 1.5 ,2, reach ,,cad\r\n"
    (row,) = read_csv(write(content), COLUMNS)
    assert row == {"row": 2, "x_mm": 1.5, "count": 2, "name": "reach", "angle_deg": None, "grade": "cad"}


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_spreadsheet_s_own_separator_and_decimal_commas_are_read(write, mark):
    text = (HEADER + "reach,official,1,592.8,\u221290.5\n").replace(",", mark).replace(".", ",")
    wanted = read_csv(write(HEADER + "reach,official,1,592.8,-90.5\n"), COLUMNS)
    assert read_csv(write(text), COLUMNS) == wanted
    left = "".join(line + 2 * mark + "\n" for line in text.splitlines())
    assert read_csv(write(left), COLUMNS) == wanted
    for number in ("592,8", "90,5"):
        with pytest.raises(InputError, match="decimal commas and points in one table"):
            read_csv(write(text.replace(number, number.replace(",", "."))), COLUMNS)
    named = HEADER.replace(",", mark) + f"3,5 mm drill{mark}official{mark}1{mark}592,8{mark}0\n"
    assert read_csv(write(named), COLUMNS)[0]["name"] == "3,5 mm drill"


def test_a_header_alone_gives_no_rows(write):
    assert read_csv(write(HEADER), COLUMNS) == []


@pytest.mark.parametrize(
    ("content", "field", "words"),
    [
        ("", None, "the file is empty. Write a header: name,grade,count,x_mm,angle_deg"),
        ("\n  \n,,\n", None, "the file is empty"),
        (HEADER.replace("x_mm", "x_cm") + GOOD, "column x_cm", "not a unit this column can have"),
        (HEADER.replace("x_mm", "x_m") + GOOD, "column x_m", "name it 'x_mm'"),
        (HEADER.replace("x_mm", "x") + GOOD, "column x", "name it 'x_mm'"),
        (HEADER.replace("angle_deg", "angle_rad") + GOOD, "column angle_rad", "name it 'angle_deg'"),
        (HEADER.replace("grade", "graed") + GOOD, "column graed", "unknown column. Did you mean 'grade'?"),
        (HEADER.replace("grade", "weather") + GOOD, "column weather", "unknown column. Known columns: name"),
        (HEADER.replace(",x_mm", "") + GOOD, "column x_mm", "missing. The header must hold: name"),
        ("A title\n" + HEADER + GOOD, "row 1", "no header of this table"),
        (HEADER.replace("name", "x_mm") + GOOD, "column x_mm", "is in the header twice"),
        (HEADER.strip() + ",\n" + GOOD, "column 6", "has no name. Name it, or remove a comma"),
        (HEADER + "reach,official,1,592.8\n", "row 2", "4 fields where the header has 5"),
        (HEADER + GOOD + "reach,official,1,592,8,90\n", "row 3", "6 fields where the header has 5"),
        (HEADER + GOOD.replace("592.8", "nan"), "row 2, column x_mm", "'nan' is not a finite number"),
        (HEADER + GOOD.replace("592.8", "-inf"), "row 2, column x_mm", "'-inf' is not a finite number"),
        (HEADER + GOOD.replace("592.8", ""), "row 2, column x_mm", "empty. Fill in a value"),
        (HEADER + GOOD.replace("592.8", "592.8 mm"), "row 2, column x_mm", "'592.8 mm' is not a number"),
        (HEADER + GOOD.replace("592.8", "1_000"), "row 2, column x_mm", "'1_000' is not a number"),
        (HEADER + GOOD.replace(",1,", ",1.5,"), "row 2, column count", "'1.5' is not a whole number. Write a whole"),
        (HEADER + GOOD.replace("official", "rumour"), "row 2, column grade", "'rumour' is not known. Write one of"),
        (HEADER + GOOD.replace("official", ""), "row 2, column grade", "empty. Fill in a value one of: official, cad"),
        (HEADER + GOOD.replace("reach", ""), "row 2, column name", "empty"),
        (HEADER + '"' + "x" * 200_000 + '",official,1,1,1\n', "line 2", "not valid CSV"),
        ((HEADER + GOOD).replace("\n", "\r"), "line 1", "not valid CSV"),
        (HEADER.encode() + b"r\xe9ach,official,1,1,1\n", "byte 33", "not UTF-8 text"),
    ],
)  # fmt: skip
def test_refusals_name_row_and_column(write, content, field, words):
    path = write(content)
    with pytest.raises(InputError) as caught:
        read_csv(path, COLUMNS)
    assert caught.value.field == field
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="there is no such file"):
        read_csv(tmp_path / "none.csv", COLUMNS)
