"""Makes the pages of the documentation site: the reference from the code, the guide from the repository's own pages."""
