"""Which release this is: the one place that says it, without looking the installed package up."""

__version__ = "0.1.0"
