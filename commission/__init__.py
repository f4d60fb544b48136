"""Browser-based commissioning of AGVs that localize on reflectors with a safety laser."""

__version__ = "0.1.0"
