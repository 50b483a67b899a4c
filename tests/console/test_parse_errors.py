"""Error boxes of tyro, framed or not, as one line; those of real words are in test_arguments."""

from console.parse_errors import one_line


def test_boxes_of_all_kinds() -> None:
    red = "\x1b[31m│\x1b[0m \x1b[1msome\x1b[0m       \x1b[31m│\x1b[0m\n"
    rule, footer = "│ ───────── │\n", "│ For full helptext, see it --help │\n"
    framed = f"╭─ Other ─╮\n{red}│ fault      │\n{rule}{footer}╰────╯\n"
    assert one_line(framed, "it now") == "some fault; see it now --help"
    assert one_line(" Other \n ------ \n  no\n  -----\n  choice.\n \n", "it") == "no; see it --help"
    assert one_line("some other\n  text\n", "it") == "some other text; see it --help"
    assert one_line("", "it") == "these arguments are no command; see it --help"


def test_a_value_whose_help_names_no_number_is_said_as_tyro_does() -> None:
    box = """Value error
------------
  Error parsing --when: not a date, arguments: ['soon']
  -----
  Argument helptext:
      --when DATE
      The day. (default: today)
"""
    assert one_line(box, "it").startswith("--when soon: not a date")


def test_the_choices_keep_their_order_without_none() -> None:
    box = "invalid choice 'x' for argument '--up'. Expected one of ('y', 'z')."
    assert one_line(box, "it") == "--up x: choose one of y, z; see it --help"
    # a set with None comes in any order
    box = "invalid choice 'x' for argument '--up'. Expected one of ('z', 'None', 'y')."
    assert one_line(box, "it") == "--up x: choose one of y, z; see it --help"
