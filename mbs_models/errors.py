"""What can be wrong with a model."""


class ModelError(ValueError):
    """A model that cannot be used: one line with file, key, value and what is allowed."""


class OrbitError(ModelError):
    """A periodic orbit that does not close, or diverges, at the amplitude asked for."""
