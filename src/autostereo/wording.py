"""Turns of phrase that errors and remarks share; needs no NumPy, which the command line loads only to work."""

from __future__ import annotations

from pathlib import Path


def counted(number: int, noun: str) -> str:
    """So many things, as "1 view" or "8 views"."""
    return f"{number} {noun}" + "s" * (number != 1)


def an(word: str) -> str:
    """A word, or letters that are spelt, with its article."""
    return f"{'an' if word[0] in 'aeiou' or word == 'rgbd' else 'a'} {word}"


def no_folder(folder: Path) -> str:
    """What is wrong with the folder of a file."""
    return f"{folder} is a file, expected a folder" if folder.exists() else f"the folder {folder} does not exist"
