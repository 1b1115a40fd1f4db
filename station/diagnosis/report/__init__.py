"""The diagnosis as one HTML page: a file for each section, a file for each figure."""
