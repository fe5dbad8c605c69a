"""What can go wrong that the designer can act on."""


class PatternError(Exception):
    """Something the user can mend: one sentence that says what is wrong, where, and what to do.

    Operators report it, scripts print it and exit with 1. Programming errors are never of this kind.
    """


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
