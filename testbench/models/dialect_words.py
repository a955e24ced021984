# SPDX-License-Identifier: Apache-2.0
"""Model of the program dialect: the words of a block, without their meaning.

Ref: ISO 6983-1; docs/reference/programs.md.
"""

import re
from decimal import ROUND_HALF_UP, Decimal

SIGNED, NAMES, OTHERS = set("XYZIJKR"), set("NOCDST"), set("GMFPLHEQUVWAB")
_NUMBER = re.compile(r"[ \t]*([+-]?)(\d+\.?\d*|\.\d+)")


class DialectError(Exception):
    """The block is not allowed by the dialect."""


def require(condition, message):
    """Raise ``DialectError`` if the block breaks a rule."""
    if not condition:
        raise DialectError(message)


def words_of(text, skip):
    """Words of a block as (letter, sign, digits); none if the block is skipped."""
    at, begun, words = 0, False, []
    while at < len(text):
        char = text[at].upper()
        if char in " \t":
            at += 1
        elif char == "(":
            end = text.find(")", at)
            require(end > 0, "comment not closed")
            require("(" not in text[at + 1:end], "comment within a comment")
            at = end + 1
        elif char == ";":
            break
        elif char == "/" and not begun:
            if skip:
                return None
            at += 1
            begun = True
        else:
            letter = "O" if char == ":" else char
            require(letter in SIGNED | NAMES | OTHERS, f"unknown {letter}")
            match = _NUMBER.match(text, at + 1)
            require(match, "no number")
            require(not match[1] or letter in SIGNED, "sign")
            words.append((letter, match[1], match[2]))
            at, begun = match.end(), True
    return words


def value_of(letter, sign, digits):
    """Value of a word; digits beyond the seventh decimal are ignored."""
    whole, _, decimals = digits.partition(".")
    decimals = decimals[:7]
    digits = f"{whole}.{decimals}" if "." in digits else digits
    significant = (whole + decimals).lstrip("0")
    require(len(significant) <= 12, "digits")
    if letter in NAMES:
        require("." not in digits, "point")
        require(int(digits) <= 99_999_999, "name")
    if letter in "GM":
        require(int(significant or "0") < 10**7, "code")
    return Decimal(digits) * (-1 if sign == "-" else 1)


def whole(words, letter, lowest, highest, default=None):
    """A whole number of a word, if it is there."""
    value = words.pop(letter, None)
    if value is None:
        return default
    require(value.as_tuple().exponent == 0 and not value.is_signed(), "whole")
    require(lowest <= value <= highest, "range")
    return int(value)


def rounded(value):
    """A whole number, half away from zero."""
    return int(value.to_integral_value(rounding=ROUND_HALF_UP))
