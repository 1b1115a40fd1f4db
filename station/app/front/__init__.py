"""The station as Python objects, which the commands print and `station/__init__.py` names."""
