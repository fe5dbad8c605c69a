"""What can go wrong that the designer can act on."""

from __future__ import annotations

from collections.abc import Callable


class PatternError(Exception):
    """Something the user can mend: one sentence that says what is wrong, where, and what to do.

    Operators report it, scripts print it and exit with 1. Programming errors are never of this kind.

    lengths: those that the sentence names in braces, such as {pitch}, in the unit of the base; a sentence
    without any is taken as it is
    """

    def __init__(self, sentence: str, **lengths: float) -> None:
        super().__init__(sentence)
        self.sentence, self.lengths = sentence, lengths

    def told(self, spelled: Callable[[float], str]) -> str:
        """The sentence with its lengths as `spelled` writes them: in the scene's unit, say."""
        if not self.lengths:
            return self.sentence
        return self.sentence.format(**{name: spelled(value) for name, value in self.lengths.items()})

    def __str__(self) -> str:
        return self.told("{:g}".format)


class RecipeError(PatternError):
    """A recipe that cannot be understood, or whose values contradict one another."""


class FieldError(PatternError):
    """A field that asks for something that is not there: an attribute, a UV map, an image, an object."""


class BaseError(PatternError):
    """A base geometry that cannot be read, or that no solid can be made of."""


class RegionError(PatternError):
    """A target region in which no pattern can be laid."""


class OutputError(PatternError):
    """A result that could not be written."""
