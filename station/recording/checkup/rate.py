"""The least rate of a stream, for the rules of a recording and for whoever watches a session that still runs."""

RATE_SHARE = 0.95
"""Share of the nominal rate: what is short by less is rounding at the ends of a short session. The live panel and the
page warn below it too, so that nobody learns only afterwards that `station doctor` rejects the recording."""
