"""The report: the diagnosis as one HTML page, with one module for each section and each figure."""
