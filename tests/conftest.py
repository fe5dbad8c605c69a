"""The same examples of hypothesis in every run, however slow the machine is."""

from hypothesis import settings

settings.register_profile("every run alike", derandomize=True, deadline=None)
settings.load_profile("every run alike")
