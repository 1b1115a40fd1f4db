"""The documentation site: what its pages are made of, and how they are made."""
