"""Code that exported files carry: it runs here in the tests and, cut out with what it needs, in the user's engine."""
