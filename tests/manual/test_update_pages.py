"""What is shown on a page follows the output, and what is left out stays left out."""

from __future__ import annotations

from update_pages import updated


def test_lines_follow_the_output() -> None:
    printed = "head\n torque │ 12.5 │ N m\n power  │ 3 │ W\nnote: it runs\nwarning: hot\n"
    assert updated("head\n torque │ 11 │ N m\n…\nwarning: hot\n", printed) == (
        "head\n torque │ 12.5 │ N m\n…\nwarning: hot\n"
    )


def test_a_new_line_between_two_is_taken_in_and_one_that_is_gone_goes() -> None:
    printed = "one 1\nnew 5\ntwo 2\n"
    assert updated("one 1\ntwo 3\nthree is gone\n", printed) == "one 1\nnew 5\ntwo 2\n"
