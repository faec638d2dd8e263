"""Table of states for a terminal: rows that read alike, at most 20 rows, marks."""

from wearsim.studies.states import states_text

KEYS = (
    "shift",
    "yaw",
    "lateral_force",
    "load_right",
    "load_left",
    "angle_right",
    "angle_left",
    "quotient_right",
    "quotient_left",
    "steering_moment",
)


def state(name, wear_number, marks=(), points=1):
    row = {"name": name, "points": points, "wear_number": wear_number}
    return {**dict.fromkeys(KEYS, 0.0), **row, "marks": list(marks)}


def test_states_that_read_alike_share_a_row():
    rows = [state(f"b{k}", 50.0) for k in range(17, 998)] + [state("other", 9.0)]
    _, _, first, second, legend = states_text(rows)
    assert first.split()[:5] == ["b17,", "980", "more", "like", "it"]
    assert second.split()[0] == "other"
    for symbol in ("H lateral force", "Q wheel loads", "M steering moment", "Tγ wear"):
        assert symbol in legend
    assert len(states_text(rows, every=True)) == 3 + 982


def test_at_most_20_rows_are_those_of_the_largest_wear_numbers():
    rows = [state(f"b{k}", float(k)) for k in range(100)]
    *table, last, _ = states_text(rows)
    assert [line.split()[0] for line in table[2:]] == [f"b{k}" for k in range(80, 100)]
    assert last == "  80 more of lower wear number Tγ; all with --all"
    assert len(states_text(rows, every=True)) == 3 + 100


def test_marks_name_their_states_below_the_table():
    rows = [state(f"b{k}", float(k), ["left flange"]) for k in range(9)]
    assert states_text(rows)[-1] == "  left flange: b0, b1, b2, b3, b4, b5 and 3 more"


def test_long_names_keep_the_width():
    name = "a curve of three hundred metres with a station in its middle"
    lines = states_text([state(name, 1e3, points=100), state("b", 2.0)])
    assert max(map(len, lines)) <= 100
    assert "... of 100 " in lines[2]


def test_no_states_have_no_table():
    assert states_text([]) == []
