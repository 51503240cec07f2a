"""Errors a user can act on. The command line prints their one sentence and exits with status 2."""

from __future__ import annotations


class AutostereoError(Exception):
    """Base of every error that autostereo raises on purpose."""


class InputError(AutostereoError, ValueError):
    """An array, a number or an option does not have the form that was expected."""


class FileError(AutostereoError, OSError):
    """A file is missing, unreadable, truncated, not writable, or not what its name says."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class UnsupportedError(AutostereoError, NotImplementedError):
    """An engine, a method or a primitive that this combination lacks; the message lists what there is."""


class DependencyError(AutostereoError, ImportError):
    """An optional package is not installed; the message names the extra to install."""


class MemoryLimitError(AutostereoError, MemoryError):
    """The result would not fit into this machine's memory."""
